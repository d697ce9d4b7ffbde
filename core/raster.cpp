#include "core/raster.h"

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/raster_cuda.h"

namespace atelier {
namespace {

constexpr int kBandRows = 16;  // rows that one task draws
constexpr Index kFaceGrain = 1024;
constexpr double kLargestCoordinate = 1e100;

/// The clipped faces in order, in fixed point, without those outside of the image.
std::vector<ScreenTriangle> screen_triangles(const std::vector<ScreenVertex>& vertices,
                                             const Triangles& faces, const Camera& camera,
                                             const RasterOptions& options) {
  const Index chunks = (faces.rows() + kFaceGrain - 1) / kFaceGrain;
  std::vector<std::vector<ScreenTriangle>> parts(static_cast<std::size_t>(chunks));
  parallel_for(faces.rows(), kFaceGrain, [&](Index begin, Index end) {
    std::vector<ScreenTriangle>& part = parts[begin / kFaceGrain];
    for (Index f = begin; f < end; ++f) {
      const ScreenPolygon polygon = clipped(vertices[faces(f, 0)], vertices[faces(f, 1)],
                                            vertices[faces(f, 2)], options.near);
      for (int k = 0; k < polygon.count - 2; ++k) {
        ScreenTriangle triangle;
        if (fan_triangle(polygon, k, static_cast<int>(f), options.cull_back, triangle)) {
          const PixelBox box = pixel_box(triangle, camera.width, camera.height);
          if (box.x0 < box.x1 && box.y0 < box.y1) {
            part.push_back(triangle);
          }
        }
      }
    }
  });
  std::vector<ScreenTriangle> triangles;
  for (const auto& part : parts) {
    triangles.insert(triangles.end(), part.begin(), part.end());
  }
  return triangles;
}

/// For each band of rows, the triangles that reach into it.
std::vector<std::vector<int>> triangles_of_bands(const std::vector<ScreenTriangle>& triangles,
                                                 const Camera& camera) {
  std::vector<std::vector<int>> bands(
      static_cast<std::size_t>((camera.height + kBandRows - 1) / kBandRows));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const PixelBox box = pixel_box(triangles[i], camera.width, camera.height);
    for (int band = box.y0 / kBandRows; band <= (box.y1 - 1) / kBandRows; ++band) {
      bands[band].push_back(static_cast<int>(i));
    }
  }
  return bands;
}

Raster rasterize_cpu(const std::vector<ScreenVertex>& vertices, const Triangles& faces,
                     const Camera& camera, const RasterOptions& options) {
  const int width = camera.width;
  const int height = camera.height;
  const auto sample = [&](int face, int x, int y) {
    return sample_face(vertices[faces(face, 0)], vertices[faces(face, 1)], vertices[faces(face, 2)],
                       x, y);
  };
  Raster raster = {ImageOf<int>(width, height, 1, -1), ImageOf<float>(width, height, 3),
                   ImageOf<float>(width, height, 1, std::numeric_limits<float>::infinity())};
  const std::vector<ScreenTriangle> triangles = screen_triangles(vertices, faces, camera, options);
  const std::vector<std::vector<int>> bands = triangles_of_bands(triangles, camera);

  const auto draw_band = [&](int band) {
    const int top = band * kBandRows;
    const int bottom = std::min(height, top + kBandRows);
    std::vector<std::uint64_t> keys(static_cast<std::size_t>(bottom - top) * width, kEmptyPixel);
    for (const int i : bands[band]) {
      const ScreenTriangle& triangle = triangles[i];
      const PixelBox box = pixel_box(triangle, width, height);
      EdgeFunctions row = edge_functions_at(triangle, box.x0, std::max(box.y0, top));
      for (int y = std::max(box.y0, top); y < std::min(box.y1, bottom); ++y, row.move(0, 1)) {
        EdgeFunctions edges = row;
        for (int x = box.x0; x < box.x1; ++x, edges.move(1, 0)) {
          if (edges.covered()) {
            std::uint64_t& key = keys[static_cast<std::size_t>(y - top) * width + x];
            key = std::min(key, pixel_key(sample(triangle.face, x, y).depth, triangle.face));
          }
        }
      }
    }
    for (int y = top; y < bottom; ++y) {
      for (int x = 0; x < width; ++x) {
        const int face = face_of(keys[static_cast<std::size_t>(y - top) * width + x]);
        if (face >= 0) {
          const PixelSample seen = sample(face, x, y);
          raster.face.at(x, y) = face;
          raster.depth.at(x, y) = static_cast<float>(seen.depth);
          for (int k = 0; k < 3; ++k) {
            raster.barycentric.at(x, y, k) = static_cast<float>(seen.barycentric[k]);
          }
        }
      }
    }
  };
  parallel_for(static_cast<Index>(bands.size()), 1, [&](Index begin, Index end) {
    for (Index band = begin; band < end; ++band) {
      draw_band(static_cast<int>(band));
    }
  });
  return raster;
}

}  // namespace

std::vector<ScreenVertex> screen_vertices(const Points& vertices, const Camera& camera,
                                          double near) {
  std::vector<ScreenVertex> screen(static_cast<std::size_t>(vertices.rows()));
  parallel_for(vertices.rows(), kFaceGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const Eigen::Vector3d point = vertices.row(i);
      const Eigen::Vector3d p = camera_from_world(camera, point);
      if (camera.distortion_model == Distortion::None) {
        screen[i] = {camera.fx * p.x() + camera.cx * p.z(), camera.fy * p.y() + camera.cy * p.z(),
                     p.z()};
        continue;
      }
      // As if a camera without distortion saw the vertex where this one does.
      const auto pixel = p.z() >= near ? project(camera, point) : std::nullopt;
      constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
      screen[i] =
          pixel ? Vec3d{pixel->x() * p.z(), pixel->y() * p.z(), p.z()} : Vec3d{kNan, kNan, kNan};
    }
  });
  return screen;
}

void check_raster(const Points& vertices, const Camera& camera, const RasterOptions& options) {
  check_camera(camera);
  if (camera.width > kLargestRasterSide || camera.height > kLargestRasterSide) {
    throw DataError(
        "", "camera " + camera.id,
        std::to_string(camera.width) + " x " + std::to_string(camera.height) + " pixels",
        "at most " + std::to_string(kLargestRasterSide) + " a side");
  }
  ATELIER_CHECK(options.near >= 1e-6 && options.near <= 1e6, "near must be 1e-6..1e6 m");
  ATELIER_CHECK(vertices.rows() == 0 || (vertices.array().abs() < kLargestCoordinate).all(),
                "a raster needs finite coordinates below 1e100 m");
}

Raster rasterize(const Points& vertices, const Triangles& faces, const Camera& camera,
                 const RasterOptions& options, Device device) {
  check_raster(vertices, camera, options);
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices.rows()),
                "a face names a vertex that is not there");
  check_device(device);
  const std::vector<ScreenVertex> screen = screen_vertices(vertices, camera, options.near);
#ifdef ATELIER_HAS_CUDA
  if (device == Device::Cuda) {
    return rasterize_cuda(screen, faces, camera.width, camera.height, options);
  }
#endif
  return rasterize_cpu(screen, faces, camera, options);
}

}  // namespace atelier
