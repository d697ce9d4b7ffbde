#include "core/render/occupied_tiles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

/// The pyramid that holds all that an image shows: half-spaces normal . point_in_camera > 0
/// outside of it. None if the lens cannot be inverted at the picture's border.
std::vector<Eigen::Vector3d> outsides_of(const Camera& camera) {
  constexpr int kSteps = 32;        // places along each side at which the lens is inverted
  constexpr double kMargin = 0.02;  // of the slope, for the border between these
  Eigen::Array2d low(0, 0);
  Eigen::Array2d high(0, 0);
  for (int i = 0; i <= kSteps; ++i) {
    const double x = camera.width * static_cast<double>(i) / kSteps;
    const double y = camera.height * static_cast<double>(i) / kSteps;
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(x, 0), Eigen::Vector2d(x, camera.height),
                                         Eigen::Vector2d(0, y), Eigen::Vector2d(camera.width, y)}) {
      const auto direction = ray_direction(camera, pixel);
      if (!direction) {
        return {};
      }
      const Eigen::Vector3d d = camera.camera_from_world_rotation * *direction;
      if (!(d.z() > 1e-3)) {
        return {};
      }
      low = low.min(d.head<2>().array() / d.z());
      high = high.max(d.head<2>().array() / d.z());
    }
  }
  low -= kMargin;
  high += kMargin;
  return {{0, 0, -1}, {-1, 0, low.x()}, {1, 0, -high.x()}, {0, -1, low.y()}, {0, 1, -high.y()}};
}

/// True where all corners lie in one half-space outside the picture's pyramid.
bool is_out_of_sight(const PreparedMesh& mesh, std::size_t first_corner, const Camera& camera,
                     const std::vector<Eigen::Vector3d>& outsides) {
  std::array<Eigen::Vector3d, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3f p = mesh.position(mesh.indices[first_corner + k]);
    corners[k] = camera_from_world(camera, Eigen::Vector3d(p.x, p.y, p.z));
  }
  return std::any_of(outsides.begin(), outsides.end(), [&](const Eigen::Vector3d& normal) {
    return std::all_of(corners.begin(), corners.end(),
                       [&](const Eigen::Vector3d& p) { return normal.dot(p) > 0; });
  });
}

}  // namespace

OccupiedTiles occupied_tiles(const PreparedScene::Data& scene, const Camera& camera, int side,
                             std::size_t meshes) {
  OccupiedTiles tiles;
  tiles.columns = (camera.width + side - 1) / side;
  tiles.rows = (camera.height + side - 1) / side;
  tiles.any.assign(static_cast<std::size_t>(tiles.columns) * static_cast<std::size_t>(tiles.rows),
                   0);
  const double bend = camera.distortion_model == Distortion::None ? 0 : 0.15;
  const std::vector<Eigen::Vector3d> outsides = outsides_of(camera);
  std::vector<std::optional<Eigen::Vector2d>> pixels;
  for (std::size_t m = 0; m < std::min(meshes, scene.meshes.size()); ++m) {
    const PreparedMesh& mesh = scene.meshes[m];
    pixels.assign(mesh.positions.size() / 3, std::nullopt);
    parallel_for(static_cast<Index>(pixels.size()), 1024, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const Vec3f p = mesh.position(static_cast<std::uint32_t>(i));
        pixels[static_cast<std::size_t>(i)] = project(camera, Eigen::Vector3d(p.x, p.y, p.z));
      }
    });
    for (std::size_t f = 0; f < mesh.indices.size(); f += 3) {
      const auto& a = pixels[mesh.indices[f]];
      const auto& b = pixels[mesh.indices[f + 1]];
      const auto& c = pixels[mesh.indices[f + 2]];
      if (!a || !b || !c) {
        if (is_out_of_sight(mesh, f, camera, outsides)) {
          continue;
        }
        tiles.any.assign(tiles.any.size(), 1);
        return tiles;
      }
      const Eigen::Vector2d low = a->cwiseMin(*b).cwiseMin(*c);
      const Eigen::Vector2d high = a->cwiseMax(*b).cwiseMax(*c);
      const double margin = 1 + bend * (high - low).maxCoeff();
      const auto tile = [&](double pixel, int last) {
        return saturating_cast<int>(std::floor(std::clamp(pixel / side, -1.0, last + 1.0)));
      };
      for (int y = std::max(0, tile(low.y() - margin, tiles.rows));
           y <= std::min(tiles.rows - 1, tile(high.y() + margin, tiles.rows)); ++y) {
        for (int x = std::max(0, tile(low.x() - margin, tiles.columns));
             x <= std::min(tiles.columns - 1, tile(high.x() + margin, tiles.columns)); ++x) {
          tiles.any[static_cast<std::size_t>(y) * static_cast<std::size_t>(tiles.columns) +
                    static_cast<std::size_t>(x)] = 1;
        }
      }
    }
  }
  return tiles;
}

}  // namespace atelier
