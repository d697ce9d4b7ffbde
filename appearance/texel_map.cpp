#include "appearance/texel_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/cross.h"
#include "core/error.h"
#include "core/raster.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// A side of a chart's border, in texels, and the same stretch of surface on the other chart.
struct Border {
  Eigen::Vector2d a{0, 0}, b{0, 0};                // of this side; the chart lies left of a -> b
  bool seam = false;                               // the surface goes on
  Eigen::Vector2d across_a{0, 0}, across_b{0, 0};  // the same points on the other chart
  Eigen::Vector2d across_third{0, 0};              // the corner of the other face off the seam
};

/// Every edge of the texture that only one face has. Charts may be mirrored: each face says on
/// which side of its edge it lies.
std::vector<Border> borders_of(const Triangles& faces, const Points2& texels,
                               const Triangles& uv_faces) {
  struct Half {
    int face, corner;
  };
  std::map<std::pair<int, int>, std::vector<Half>> by_surface;
  std::map<std::pair<int, int>, int> by_texture;
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      by_surface[std::minmax(faces(f, k), faces(f, (k + 1) % 3))].push_back(
          {static_cast<int>(f), k});
      ++by_texture[std::minmax(uv_faces(f, k), uv_faces(f, (k + 1) % 3))];
    }
  }
  std::vector<Border> borders;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector2d corner[3] = {texels.row(uv_faces(f, 0)), texels.row(uv_faces(f, 1)),
                                       texels.row(uv_faces(f, 2))};
    const double turn = cross(corner[1] - corner[0], corner[2] - corner[0]);
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      if (by_texture.at(std::minmax(uv_faces(f, k), uv_faces(f, next))) != 1) {
        continue;
      }
      Border border;
      border.a = corner[k];
      border.b = corner[next];
      for (const Half& other : by_surface.at(std::minmax(faces(f, k), faces(f, next)))) {
        if (other.face != f) {
          const int end = (other.corner + 1) % 3;
          const bool turned = faces(other.face, other.corner) != faces(f, k);
          border.seam = true;
          border.across_a = texels.row(uv_faces(other.face, turned ? end : other.corner));
          border.across_b = texels.row(uv_faces(other.face, turned ? other.corner : end));
          border.across_third = texels.row(uv_faces(other.face, (other.corner + 2) % 3));
        }
      }
      if (turn < 0) {
        std::swap(border.a, border.b);
        std::swap(border.across_a, border.across_b);
      }
      borders.push_back(border);
    }
  }
  return borders;
}

/// How near a texel is to a border, and where it takes its value from.
struct Nearest {
  double squared = std::numeric_limits<double>::infinity();
  Eigen::Vector2d from{0, 0};
};

/// The place that `texel`, outside of a chart beside `border`, stands for.
Nearest beyond(const Border& border, const Eigen::Vector2d& texel) {
  const Eigen::Vector2d along = border.b - border.a;
  const double length = along.norm();
  Nearest result;
  if (!(length > 0)) {
    return result;
  }
  const double t = std::clamp((texel - border.a).dot(along) / (length * length), 0.0, 1.0);
  const Eigen::Vector2d foot = border.a + t * along;
  const Eigen::Vector2d away = texel - foot;
  result.squared = away.squaredNorm();
  constexpr double kInside = 0.5;  // texels: what has its centre inside is covered
  if (!border.seam) {
    const Eigen::Vector2d inward = Eigen::Vector2d(-along.y(), along.x()) / length;
    result.from = foot + kInside * inward;
    return result;
  }
  // The other side's frame: along the seam, and away from it into the other chart.
  const Eigen::Vector2d across = border.across_b - border.across_a;
  const double other_length = across.norm();
  if (!(other_length > 0)) {
    return {};
  }
  const double side = cross(across, border.across_third - border.across_a) < 0 ? -1 : 1;
  const Eigen::Vector2d inward = side * Eigen::Vector2d(-across.y(), across.x()) / other_length;
  result.from = border.across_a + t * across +
                std::max(away.norm() * other_length / length, kInside) * inward;
  return result;
}

/// The covered texel nearest to a place, within two texels of it; -1: none.
int settle(const ImageOf<int>& face, const Eigen::Vector2d& place) {
  constexpr int kLook = 2;
  const int left = saturating_cast<int>(std::floor(place.x()) - kLook);
  const int top = saturating_cast<int>(std::floor(place.y()) - kLook);
  const int right = saturating_cast<int>(std::floor(place.x()) + kLook);
  const int bottom = saturating_cast<int>(std::floor(place.y()) + kLook);
  int best = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (int y = std::max(0, top); y <= std::min(face.height - 1, bottom); ++y) {
    for (int x = std::max(0, left); x <= std::min(face.width - 1, right); ++x) {
      const double distance = (Eigen::Vector2d(x + 0.5, y + 0.5) - place).squaredNorm();
      if (face.at(x, y) >= 0 && distance < nearest) {
        nearest = distance;
        best = y * face.width + x;
      }
    }
  }
  return best;
}

void fill_sources(TexelMap& map, const std::vector<Border>& borders, int reach) {
  const int size = map.resolution;
  std::vector<Nearest> nearest(static_cast<std::size_t>(size) * size);
  for (const Border& border : borders) {
    const Eigen::Vector2d low = border.a.cwiseMin(border.b);
    const Eigen::Vector2d high = border.a.cwiseMax(border.b);
    const int x0 = std::max(0, saturating_cast<int>(std::floor(low.x()) - reach));
    const int y0 = std::max(0, saturating_cast<int>(std::floor(low.y()) - reach));
    const int x1 = std::min(size - 1, saturating_cast<int>(std::ceil(high.x()) + reach));
    const int y1 = std::min(size - 1, saturating_cast<int>(std::ceil(high.y()) + reach));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        if (map.face.at(x, y) < 0) {
          const Nearest found = beyond(border, {x + 0.5, y + 0.5});
          Nearest& best = nearest[static_cast<std::size_t>(y) * size + x];
          if (found.squared < best.squared && found.squared <= reach * reach) {
            best = found;
          }
        }
      }
    }
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (std::isfinite(nearest[i].squared)) {
      const int from = settle(map.face, nearest[i].from);
      map.source[i] = from >= 0 ? from : map.source[i];
    }
  }
}

}  // namespace

void check_atlas(const Points2& uvs, const std::string& file) {
  if (uvs.rows() > 0 && !(uvs.minCoeff() >= 0 && uvs.maxCoeff() <= 1)) {
    throw DataError(file, "texture coordinates", "some outside of [0, 1]",
                    "an atlas inside the unit square (pack_atlas)");
  }
}

TexelMap texel_map(const Triangles& faces, const Points2& uvs, const Triangles& uv_faces,
                   int resolution, int reach) {
  ATELIER_CHECK(resolution >= 4 && resolution <= 8192, "a texture has 4 to 8192 texels a side");
  ATELIER_CHECK(reach >= 0 && reach <= 64, "sources reach 0 to 64 texels");
  ATELIER_CHECK(faces.rows() == uv_faces.rows(), "faces and texture faces differ in number");
  ATELIER_CHECK(
      uv_faces.rows() == 0 || (uv_faces.minCoeff() >= 0 && uv_faces.maxCoeff() < uvs.rows()),
      "a texture face names a coordinate that is not there");
  check_atlas(uvs);
  // Texels are the pixels of a camera that looks at the plane z = 1.
  Camera camera;
  camera.id = "texture";
  camera.width = camera.height = resolution;
  camera.fx = camera.fy = 1;
  Points flat(uvs.rows(), 3);
  flat.col(0) = resolution * uvs.col(0);
  flat.col(1) = resolution * (1 - uvs.col(1).array());
  flat.col(2).setOnes();
  Raster raster = rasterize(flat, uv_faces, camera);
  TexelMap map;
  map.resolution = resolution;
  map.face = std::move(raster.face);
  map.barycentric = std::move(raster.barycentric);
  map.source.resize(map.face.data.size());
  for (std::size_t i = 0; i < map.face.data.size(); ++i) {
    map.source[i] = static_cast<int>(i);
    if (map.face.data[i] >= 0) {
      map.covered.push_back(static_cast<int>(i));
    }
  }
  fill_sources(map, borders_of(faces, flat.leftCols(2), uv_faces), reach);
  return map;
}

}  // namespace atelier
