#include <limits>

#include "core/raster_cuda.cuh"

namespace atelier {
namespace {

constexpr int kWarp = 32;
constexpr int kTileWidth = 8;  // a warp draws tiles of 8 x 4 pixels
constexpr int kTileHeight = 4;

__global__ void clear_keys(unsigned long long* keys, std::size_t n) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) {
    keys[i] = kEmptyPixel;
  }
}

/// One warp a face. The smallest key wins whatever the order of the threads.
__global__ void draw_faces(const ScreenVertex* vertices, const int* faces, int face_count,
                           int width, int height, RasterOptions options, unsigned long long* keys) {
  const std::size_t thread = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (thread / kWarp >= static_cast<std::size_t>(face_count)) {
    return;
  }
  const int face = static_cast<int>(thread / kWarp);
  const int lane_x = static_cast<int>(thread % kTileWidth);
  const int lane_y = static_cast<int>(thread % kWarp) / kTileWidth;
  const Vec3d a = vertices[faces[3 * face]];
  const Vec3d b = vertices[faces[3 * face + 1]];
  const Vec3d c = vertices[faces[3 * face + 2]];
  const ScreenPolygon polygon = clipped(a, b, c, options.near);
  for (int k = 0; k < polygon.count - 2; ++k) {
    ScreenTriangle triangle;
    if (!fan_triangle(polygon, k, face, options.cull_back, triangle)) {
      continue;
    }
    const PixelBox box = pixel_box(triangle, width, height);
    EdgeFunctions row = edge_functions_at(triangle, box.x0 + lane_x, box.y0 + lane_y);
    for (int y = box.y0 + lane_y; y < box.y1; y += kTileHeight, row.move(0, kTileHeight)) {
      EdgeFunctions edges = row;
      for (int x = box.x0 + lane_x; x < box.x1; x += kTileWidth, edges.move(kTileWidth, 0)) {
        if (edges.covered()) {
          const unsigned long long key = pixel_key(sample_face(a, b, c, x, y).depth, face);
          atomicMin(&keys[static_cast<std::size_t>(y) * width + x], key);
        }
      }
    }
  }
}

__global__ void resolve_pixels(const ScreenVertex* vertices, const int* faces,
                               const unsigned long long* keys, int width, std::size_t pixels,
                               float background, int* face, float* barycentric, float* depth) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= pixels) {
    return;
  }
  const int f = face_of(keys[i]);
  PixelSample seen = {{0, 0, 0}, background};
  if (f >= 0) {
    seen =
        sample_face(vertices[faces[3 * f]], vertices[faces[3 * f + 1]], vertices[faces[3 * f + 2]],
                    static_cast<int>(i % width), static_cast<int>(i / width));
  }
  face[i] = f;
  depth[i] = static_cast<float>(seen.depth);
  for (int k = 0; k < 3; ++k) {
    barycentric[3 * i + k] = static_cast<float>(seen.barycentric[k]);
  }
}

}  // namespace

void rasterize_on_device(const ScreenVertex* vertices, const int* faces, int face_count, int width,
                         int height, const RasterOptions& options, CudaRaster& raster) {
  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  if (raster.face.size() != pixels) {
    raster = CudaRaster();  // before the new one is taken
    raster = {CudaBuffer<int>(pixels), CudaBuffer<float>(3 * pixels), CudaBuffer<float>(pixels),
              CudaBuffer<unsigned long long>(pixels)};
  }
  const unsigned pixel_blocks = cuda_blocks(static_cast<std::ptrdiff_t>(pixels));
  clear_keys<<<pixel_blocks, kCudaBlock>>>(raster.keys.data(), pixels);
  ATELIER_CUDA_LAUNCHED(clear_keys);
  if (face_count > 0) {
    draw_faces<<<cuda_blocks(static_cast<std::ptrdiff_t>(face_count) * kWarp), kCudaBlock>>>(
        vertices, faces, face_count, width, height, options, raster.keys.data());
    ATELIER_CUDA_LAUNCHED(draw_faces);
  }
  resolve_pixels<<<pixel_blocks, kCudaBlock>>>(
      vertices, faces, raster.keys.data(), width, pixels, std::numeric_limits<float>::infinity(),
      raster.face.data(), raster.barycentric.data(), raster.depth.data());
  ATELIER_CUDA_LAUNCHED(resolve_pixels);
}

Raster rasterize_cuda(const std::vector<ScreenVertex>& vertices, const Triangles& faces, int width,
                      int height, const RasterOptions& options) {
  const CudaBuffer<ScreenVertex> device_vertices(vertices);
  const CudaBuffer<int> device_faces(faces.data(), static_cast<std::size_t>(faces.size()));
  CudaRaster drawn;
  rasterize_on_device(device_vertices.data(), device_faces.data(), static_cast<int>(faces.rows()),
                      width, height, options, drawn);
  Raster raster = {ImageOf<int>(width, height, 1), ImageOf<float>(width, height, 3),
                   ImageOf<float>(width, height, 1)};
  raster.face.data = drawn.face.download();
  raster.barycentric.data = drawn.barycentric.download();
  raster.depth.data = drawn.depth.download();
  return raster;
}

}  // namespace atelier
