#include "capture/atlas.h"

#include <algorithm>
#include <cmath>

#include "core/cross.h"
#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kGrow = 8;

void grow(Atlas& atlas) {
  const int n = atlas.position.width;
  ImageOf<char> known = atlas.covered;
  for (int step = 0; step < kGrow; ++step) {
    const ImageOf<char> before = known;
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        if (before.at(x, y) != 0) {
          continue;
        }
        for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          const int i = x + dx;
          const int j = y + dy;
          if (i >= 0 && j >= 0 && i < n && j < n && before.at(i, j) != 0) {
            for (int c = 0; c < 3; ++c) {
              atlas.position.at(x, y, c) = atlas.position.at(i, j, c);
            }
            known.at(x, y) = 1;
            break;
          }
        }
      }
    }
  }
}

}  // namespace

Atlas mesh_atlas(const Mesh& mesh, int resolution) {
  ATELIER_CHECK(mesh.uvs.rows() > 0 && mesh.uv_faces.rows() == mesh.faces.rows(),
                "an atlas needs texture coordinates");
  ATELIER_CHECK(resolution >= 16 && resolution <= 16384, "resolution must be in [16, 16384]");
  const int n = resolution;
  Atlas atlas{Image(n, n, 3), ImageOf<char>(n, n, 1)};
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    Eigen::Vector2d corner[3];
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector2d uv = mesh.uvs.row(mesh.uv_faces(f, c)).transpose();
      corner[c] = {uv.x() * n, (1 - uv.y()) * n};
    }
    const double area = cross(corner[1] - corner[0], corner[2] - corner[0]);
    if (std::abs(area) < 1e-12) {
      continue;
    }
    const auto bound = [&](int axis, bool high) {
      const auto [low, most] = std::minmax({corner[0][axis], corner[1][axis], corner[2][axis]});
      return std::clamp(saturating_cast<int>(std::floor(high ? most : low)), 0, n - 1);
    };
    for (int y = bound(1, false); y <= bound(1, true); ++y) {
      for (int x = bound(0, false); x <= bound(0, true); ++x) {
        const Eigen::Vector2d p(x + 0.5, y + 0.5);
        const double b1 = cross(p - corner[0], corner[2] - corner[0]) / area;
        const double b2 = cross(corner[1] - corner[0], p - corner[0]) / area;
        if (b1 < 0 || b2 < 0 || b1 + b2 > 1) {
          continue;
        }
        const Eigen::RowVector3d position = (1 - b1 - b2) * mesh.vertices.row(mesh.faces(f, 0)) +
                                            b1 * mesh.vertices.row(mesh.faces(f, 1)) +
                                            b2 * mesh.vertices.row(mesh.faces(f, 2));
        for (int c = 0; c < 3; ++c) {
          atlas.position.at(x, y, c) = static_cast<float>(position[c]);
        }
        atlas.covered.at(x, y) = 1;
      }
    }
  }
  grow(atlas);
  return atlas;
}

}  // namespace atelier
