#include <optional>

#include "appearance/occlusion_cuda.cuh"
#include "appearance/shown_surfaces_backend.h"
#include "appearance/surface_math.h"
#include "core/error.h"
#include "core/raster_cuda.cuh"
#include "core/tree_cuda.cuh"

namespace atelier {
namespace {

/// Corners (3 * face + its place there) that meet at each point, in the order of the faces, so that
/// sums over them are those of a loop over faces.
struct CornersAtPoints {
  CudaBuffer<int> begin;   // [N+1]
  CudaBuffer<int> corner;  // [3F]
};

CornersAtPoints corners_at_points(const Triangles& faces, Index points) {
  std::vector<int> begin(static_cast<std::size_t>(points) + 1, 0);
  for (Index i = 0; i < faces.size(); ++i) {
    ++begin[static_cast<std::size_t>(faces.data()[i]) + 1];
  }
  for (std::size_t i = 1; i < begin.size(); ++i) {
    begin[i] += begin[i - 1];
  }
  std::vector<int> next(begin.begin(), begin.end() - 1);
  std::vector<int> corner(static_cast<std::size_t>(faces.size()));
  for (Index i = 0; i < faces.size(); ++i) {
    corner[static_cast<std::size_t>(next[static_cast<std::size_t>(faces.data()[i])]++)] =
        static_cast<int>(i);
  }
  return {CudaBuffer<int>(begin), CudaBuffer<int>(corner)};
}

/// Positions and normals as floats, and as the rays start with them.
__global__ void shape_vertices(const Vec3d* vertices, int count, const int* faces,
                               const int* corner_begin, const int* corner, float* position,
                               float* normal, Vec3d* ray_position, Vec3d* ray_normal) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) {
    return;
  }
  Vec3d sum = {0, 0, 0};
  for (int j = corner_begin[i]; j < corner_begin[i + 1]; ++j) {
    const int* face = faces + corner[j] / 3 * 3;
    const int k = corner[j] % 3;
    const Vec3d u = vertices[face[(k + 1) % 3]] - vertices[i];
    const Vec3d v = vertices[face[(k + 2) % 3]] - vertices[i];
    sum += angle_weighted_normal(vertices[face[0]], vertices[face[1]], vertices[face[2]], u, v);
  }
  // Normals that cancel leave rounding, not a direction.
  const double length = norm(sum);
  const Vec3d unit = length > 1e-12 ? 1 / length * sum : Vec3d{0, 0, 0};
  const Vec3f at = {static_cast<float>(vertices[i].x), static_cast<float>(vertices[i].y),
                    static_cast<float>(vertices[i].z)};
  const Vec3f along = {static_cast<float>(unit.x), static_cast<float>(unit.y),
                       static_cast<float>(unit.z)};
  position[3 * i] = at.x;
  position[3 * i + 1] = at.y;
  position[3 * i + 2] = at.z;
  normal[3 * i] = along.x;
  normal[3 * i + 1] = along.y;
  normal[3 * i + 2] = along.z;
  const Vec3d outward = {along.x, along.y, along.z};
  ray_position[i] = {at.x, at.y, at.z};
  ray_normal[i] = norm(outward) > 0 ? 1 / norm(outward) * outward : Vec3d{0, 1, 0};
}

__global__ void shape_tangents(const Vec3d* vertices, const int* faces, const double* uvs,
                               int count, const int* uv_faces, const int* corner_begin,
                               const int* corner, float* tangent) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) {
    return;
  }
  Vec3d sum = {0, 0, 0};
  for (int j = corner_begin[i]; j < corner_begin[i + 1]; ++j) {
    const int* face = faces + corner[j] / 3 * 3;
    const int* uv_face = uv_faces + corner[j] / 3 * 3;
    sum += area_along_u(vertices[face[0]], vertices[face[1]], vertices[face[2]],
                        uvs + 2 * uv_face[0], uvs + 2 * uv_face[1], uvs + 2 * uv_face[2]);
  }
  const double length = norm(sum);
  const Vec3d unit = length > 0 ? 1 / length * sum : Vec3d{0, 0, 0};
  tangent[3 * i] = static_cast<float>(unit.x);
  tangent[3 * i + 1] = static_cast<float>(unit.y);
  tangent[3 * i + 2] = static_cast<float>(unit.z);
}

__global__ void share_open(const OpenRays* open, int count, int rays, float* transfer) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < count) {
    transfer[i] = transfer_of(open[i / kTransferTerms].terms[i % kTransferTerms], rays);
  }
}

__global__ void mark_seen(const int* face, int pixels, const int* end_face, int* seen) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= pixels || face[i] < 0) {
    return;
  }
  int s = 0;
  while (face[i] >= end_face[s]) {
    ++s;
  }
  if (seen[s] == 0) {
    seen[s] = 1;
  }
}

__global__ void color_pixels(const PictureLayer* layers, int layer_count, RasterView raster,
                             int width, int pixels, PictureStyle style, PictureColor* picture) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < pixels) {
    picture[i] = picture_color(layers, layer_count, raster, i % width, i / width, style);
  }
}

/// Memory for so many, taken anew only for another number.
template <class T>
void resize(CudaBuffer<T>& buffer, std::size_t size) {
  if (buffer.size() != size) {
    buffer = CudaBuffer<T>();
    buffer = CudaBuffer<T>(size);
  }
}

/// Buffers of a surface that stay on the device, and those that each image recomputes.
struct SurfaceOnDevice {
  Index first_vertex;
  int vertices, coordinates;
  CudaBuffer<int> faces, uv_faces;
  CudaBuffer<double> uvs;
  CudaBuffer<float> float_uvs;
  CornersAtPoints at_vertices, at_uvs;
  CudaBuffer<float> position, normal, tangent, transfer;
  CudaBuffer<Vec3d> ray_position, ray_normal;
  CudaBuffer<OpenRays> open;
};

SurfaceOnDevice surface_on_device(const ShownSurface& surface, Index first_vertex) {
  const auto size = [](Index rows, int columns) {
    return static_cast<std::size_t>(rows * columns);
  };
  const Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor> uvs = surface.uvs.cast<float>();
  SurfaceOnDevice one = {first_vertex,
                         static_cast<int>(surface.vertices),
                         static_cast<int>(surface.uvs.rows()),
                         CudaBuffer<int>(surface.faces.data(), size(surface.faces.rows(), 3)),
                         CudaBuffer<int>(surface.uv_faces.data(), size(surface.uv_faces.rows(), 3)),
                         CudaBuffer<double>(surface.uvs.data(), size(surface.uvs.rows(), 2)),
                         CudaBuffer<float>(uvs.data(), size(uvs.rows(), 2)),
                         corners_at_points(surface.faces, surface.vertices),
                         corners_at_points(surface.uv_faces, surface.uvs.rows()),
                         CudaBuffer<float>(size(surface.vertices, 3)),
                         CudaBuffer<float>(size(surface.vertices, 3)),
                         CudaBuffer<float>(size(surface.uvs.rows(), 3)),
                         CudaBuffer<float>(size(surface.vertices, 2 * kTransferTerms)),
                         CudaBuffer<Vec3d>(size(surface.vertices, 1)),
                         CudaBuffer<Vec3d>(size(surface.vertices, 1)),
                         CudaBuffer<OpenRays>(size(surface.vertices, 2))};
  one.transfer.clear();  // of what no image sees nothing is asked
  return one;
}

class CudaShownSurfaces : public ShownSurfaces {
 public:
  CudaShownSurfaces(std::vector<ShownSurface> surfaces, const PaintOptions& options)
      : surfaces_(std::move(surfaces)),
        options_(options),
        all_faces_(faces_of_all(surfaces_)),
        faces_(all_faces_.data(), static_cast<std::size_t>(all_faces_.size())) {
    std::vector<int> end_face;
    Index vertex = 0;
    int face = 0;
    for (const ShownSurface& surface : surfaces_) {
      on_device_.push_back(surface_on_device(surface, vertex));
      vertex += surface.vertices;
      face += static_cast<int>(surface.faces.rows());
      end_face.push_back(face);
    }
    end_face_ = CudaBuffer<int>(end_face);
    seen_ = CudaBuffer<int>(surfaces_.size());
    layers_ = CudaBuffer<PictureLayer>(surfaces_.size());
    vertices_ = CudaBuffer<Vec3d>(static_cast<std::size_t>(vertex));
    screen_ = CudaBuffer<ScreenVertex>(static_cast<std::size_t>(vertex));
  }

  std::vector<bool> look(const Points& vertices, const Camera& camera) override {
    require_shown_vertices(surfaces_, vertices);
    const RasterOptions raster_options;
    check_raster(vertices, camera, raster_options);
    vertices_.upload(reinterpret_cast<const Vec3d*>(vertices.data()), vertices_.size());
    screen_.upload(screen_vertices(vertices, camera, raster_options.near));
    eye_ = camera_center(camera);
    width_ = camera.width;
    height_ = camera.height;
    rasterize_on_device(screen_.data(), faces_.data(), static_cast<int>(all_faces_.rows()), width_,
                        height_, raster_options, raster_);
    seen_.clear();
    const int pixels = width_ * height_;
    mark_seen<<<cuda_blocks(pixels), kCudaBlock>>>(raster_.face.data(), pixels, end_face_.data(),
                                                   seen_.data());
    ATELIER_CUDA_LAUNCHED(mark_seen);
    const std::vector<int> seen = seen_.download();
    if (tree_) {
      tree_->refit(vertices_.data());
    } else {
      tree_.emplace(build_tree(vertices, all_faces_));
    }
    return {seen.begin(), seen.end()};
  }

  SurfaceArrays surface(std::size_t which) override {
    ATELIER_CHECK(which < surfaces_.size() && tree_, "a surface that was not given");
    SurfaceOnDevice& own = on_device_[which];
    const Vec3d* vertices = vertices_.data() + own.first_vertex;
    if (own.vertices > 0) {
      shape_vertices<<<cuda_blocks(own.vertices), kCudaBlock>>>(
          vertices, own.vertices, own.faces.data(), own.at_vertices.begin.data(),
          own.at_vertices.corner.data(), own.position.data(), own.normal.data(),
          own.ray_position.data(), own.ray_normal.data());
      ATELIER_CUDA_LAUNCHED(shape_vertices);
      shape_tangents<<<cuda_blocks(own.coordinates), kCudaBlock>>>(
          vertices, own.faces.data(), own.uvs.data(), own.coordinates, own.uv_faces.data(),
          own.at_uvs.begin.data(), own.at_uvs.corner.data(), own.tangent.data());
      ATELIER_CUDA_LAUNCHED(shape_tangents);
      const OcclusionOptions& occlusion = options_.occlusion;
      open_rays_on_device(tree_->view(), own.ray_position.data(), own.ray_normal.data(),
                          own.vertices, {occlusion.strata, occlusion.reach, occlusion.offset},
                          own.open.data());
      const int numbers = 2 * kTransferTerms * own.vertices;
      share_open<<<cuda_blocks(numbers), kCudaBlock>>>(
          own.open.data(), numbers, occlusion.strata * occlusion.strata, own.transfer.data());
      ATELIER_CUDA_LAUNCHED(share_open);
    }
    return {own.position.data(), own.normal.data(), own.tangent.data(),
            own.transfer.data(), own.vertices,      own.coordinates};
  }

  Image picture(const std::vector<SurfaceLook>& looks) override {
    const PictureStyle style = picture_style(options_, eye_);
    Image picture(width_ / style.samples, height_ / style.samples, 4);  // while the device works
    std::vector<PictureLayer> layers = picture_layers(surfaces_, looks);
    for (std::size_t s = 0; s < layers.size(); ++s) {
      layers[s].faces = on_device_[s].faces.data();
      layers[s].uv_faces = on_device_[s].uv_faces.data();
      layers[s].uvs = on_device_[s].float_uvs.data();
      layers[s].position = on_device_[s].position.data();
      layers[s].transfer = on_device_[s].transfer.data();
    }
    layers_.upload(layers);
    const int pixels = picture.width * picture.height;
    resize(picture_, static_cast<std::size_t>(pixels));
    color_pixels<<<cuda_blocks(pixels), kCudaBlock>>>(
        layers_.data(), static_cast<int>(layers.size()),
        RasterView{raster_.face.data(), raster_.barycentric.data(), width_}, picture.width, pixels,
        style, picture_.data());
    ATELIER_CUDA_LAUNCHED(color_pixels);
    ATELIER_CUDA_CHECK(cudaMemcpy(picture.data.data(), picture_.data(),
                                  picture.data.size() * sizeof(float), cudaMemcpyDeviceToHost));
    return picture;
  }

  void wait() const override { ATELIER_CUDA_CHECK(cudaDeviceSynchronize()); }

 private:
  std::vector<ShownSurface> surfaces_;
  PaintOptions options_;
  Triangles all_faces_;
  CudaBuffer<int> faces_;
  std::vector<SurfaceOnDevice> on_device_;
  CudaBuffer<int> end_face_, seen_;
  CudaBuffer<PictureLayer> layers_;
  CudaBuffer<Vec3d> vertices_;
  CudaBuffer<ScreenVertex> screen_;
  std::optional<CudaTree<double>> tree_;
  CudaRaster raster_;
  Eigen::Vector3d eye_ = Eigen::Vector3d::Zero();
  int width_ = 0;
  int height_ = 0;
  CudaBuffer<PictureColor> picture_;
};

}  // namespace

std::unique_ptr<ShownSurfaces> make_cuda_shown_surfaces(std::vector<ShownSurface> surfaces,
                                                        const PaintOptions& options) {
  return std::make_unique<CudaShownSurfaces>(std::move(surfaces), options);
}

}  // namespace atelier
