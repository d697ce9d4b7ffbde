#include "capture/stitching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kSeamHalfWidth = 0.0009;    // m
constexpr double kEdgeWidth = 0.0012;        // m, of the fold's own edge
constexpr double kStitchHalfWidth = 0.0007;  // m
constexpr double kStitchShare = 0.62;        // of a stitch that lies on top of the cloth

constexpr double kBleed = 3;  // texels beyond an edge that filters of the texture reach

/// One side of a face, in texels: from `a` to `b`, with the cloth where `inward` points.
struct Side {
  Eigen::Vector2d a{0, 0}, b{0, 0}, inward{0, 0};
  bool opening = false;
};

std::vector<Side> sides_of(const Mesh& garment, const Image& albedo) {
  using Edge = std::pair<int, int>;
  const auto edge = [](const Triangles& faces, Index f, int c) -> Edge {
    return std::minmax(faces(f, c), faces(f, (c + 1) % 3));
  };
  std::map<Edge, int> in_cloth;
  std::map<Edge, int> in_texture;
  for (Index f = 0; f < garment.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      ++in_cloth[edge(garment.faces, f, c)];
      ++in_texture[edge(garment.uv_faces, f, c)];
    }
  }
  std::vector<Side> sides;
  for (Index f = 0; f < garment.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const bool opening = in_cloth[edge(garment.faces, f, c)] == 1;
      if (!opening && in_texture[edge(garment.uv_faces, f, c)] > 1) {
        continue;
      }
      const auto texel = [&](int corner) {
        const Eigen::Vector2d uv = garment.uvs.row(garment.uv_faces(f, corner)).transpose();
        return Eigen::Vector2d(uv.x() * albedo.width, (1 - uv.y()) * albedo.height);
      };
      Side side{texel(c), texel((c + 1) % 3), {0, 0}, opening};
      const Eigen::Vector2d d = side.b - side.a;
      const Eigen::Vector2d across = Eigen::Vector2d(-d.y(), d.x()).normalized();
      side.inward = across.dot(texel((c + 2) % 3) - side.a) < 0 ? Eigen::Vector2d(-across) : across;
      sides.push_back(side);
    }
  }
  return sides;
}

/// Per texel, metres to the nearest opening and seam, and how far along the opening it lies.
struct Distances {
  ImageOf<float> opening, along, seam;
};

void add_side(Distances& distances, const Side& side, double reach, double texel) {
  const Eigen::Vector2d d = side.b - side.a;
  const double length2 = d.squaredNorm();
  if (length2 <= 0) {
    return;
  }
  const double margin = reach / texel + 1;
  const auto bound = [&](int axis, double sign, int size) {
    const double end = sign * std::max(sign * side.a[axis], sign * side.b[axis]);
    return saturating_cast<int>(std::clamp(std::floor(end + sign * margin), 0.0, size - 1.0));
  };
  ImageOf<float>& nearest = side.opening ? distances.opening : distances.seam;
  for (int y = bound(1, -1, nearest.height); y <= bound(1, 1, nearest.height); ++y) {
    for (int x = bound(0, -1, nearest.width); x <= bound(0, 1, nearest.width); ++x) {
      const Eigen::Vector2d p(x + 0.5, y + 0.5);
      if ((p - side.a).dot(side.inward) < -kBleed) {
        continue;  // beyond the edge may lie another panel
      }
      const double t = std::clamp((p - side.a).dot(d) / length2, 0.0, 1.0);
      const auto distance = static_cast<float>(texel * (p - side.a - t * d).norm());
      if (distance < nearest.at(x, y)) {
        nearest.at(x, y) = distance;
        if (side.opening) {
          distances.along.at(x, y) = static_cast<float>(texel * t * std::sqrt(length2));
        }
      }
    }
  }
}

/// The share of a texel that lies in [low, high].
double covered(double at, double low, double high, double texel) {
  const double begin = std::max(low, at - texel / 2);
  const double end = std::min(high, at + texel / 2);
  return std::clamp((end - begin) / texel, 0.0, 1.0);
}

}  // namespace

Image with_stitching(const Image& albedo, const Mesh& garment, double metres,
                     const StitchingOptions& options) {
  ATELIER_CHECK(garment.uvs.rows() > 0 && garment.uv_faces.rows() == garment.faces.rows(),
                "stitching needs texture coordinates");
  ATELIER_CHECK(metres > 0 && albedo.channels == 3, "stitching needs a colour texture with a size");
  ATELIER_CHECK(options.hem >= 0 && options.hem <= 0.2 && options.stitch >= 0.0005 &&
                    options.stitch <= 0.1 && options.fold_shade >= 0 && options.fold_shade <= 1 &&
                    options.line_shade >= 0 && options.line_shade <= 1,
                "stitching options are out of range");
  const double texel = metres / albedo.width;
  constexpr float kFar = std::numeric_limits<float>::max();
  Distances distances{ImageOf<float>(albedo.width, albedo.height, 1, kFar),
                      ImageOf<float>(albedo.width, albedo.height, 1, 0.0F),
                      ImageOf<float>(albedo.width, albedo.height, 1, kFar)};
  for (const Side& side : sides_of(garment, albedo)) {
    add_side(distances, side, side.opening ? options.hem : kSeamHalfWidth, texel);
  }
  Image result = albedo;
  for (int y = 0; y < albedo.height; ++y) {
    for (int x = 0; x < albedo.width; ++x) {
      const double opening = distances.opening.at(x, y);
      const double seam = distances.seam.at(x, y);
      double line = covered(seam, -1, kSeamHalfWidth, texel);
      double fold = 0;
      if (opening < options.hem + texel) {
        fold = covered(opening, -1, options.hem, texel);
        line = std::max(line, covered(opening, -1, kEdgeWidth, texel));
        const double row = 0.86 * options.hem;
        const double phase = distances.along.at(x, y) / options.stitch;
        // Where texels are coarser than stitches, their mean.
        const double on_top = texel > options.stitch / 2
                                  ? kStitchShare
                                  : (phase - std::floor(phase) < kStitchShare ? 1.0 : 0.0);
        line = std::max(
            line, on_top * covered(opening, row - kStitchHalfWidth, row + kStitchHalfWidth, texel));
      }
      const auto shade = static_cast<float>((1 - fold * (1 - options.fold_shade)) *
                                            (1 - line * (1 - options.line_shade)));
      for (int c = 0; c < 3; ++c) {
        result.at(x, y, c) *= shade;
      }
    }
  }
  return result;
}

}  // namespace atelier
