#pragma once

#include <vector>

#include "core/image.h"
#include "core/options.h"
#include "core/raster.h"
#include "core/types.h"

namespace atelier {

struct VisibleOptions {
  int erosion = 2;           ///< px kept away from silhouettes and depth jumps, 0..32
  double depth_jump = 0.02;  ///< m between neighbouring pixels that make a jump, (0, 10]
};
OptionTable describe(VisibleOptions& options);

/// The visible pixels of one surface among others.
struct VisiblePixels {
  std::vector<int> pixel;     ///< [P] y * width + x, increasing
  std::vector<float> u, v;    ///< [P] its place in the texture, v up
  std::vector<float> depth;   ///< [P] metres along the camera's axis
  std::vector<char> trusted;  ///< [P] 1: away from silhouettes and depth jumps
};

/// The pixels of a raster whose centre sees one surface before all others, with their texture
/// coordinates (perspective-correct). Pixels of which every neighbour within `erosion` sees the
/// same surface, with no depth jump between neighbours, are trusted: what blurs, moves or is
/// registered by a pixel too far there stays out of a loss. Throws LogicError unless uv_faces are
/// rows that the raster may name.
/// @param first_face  of the surface in the raster; it has as many as `uv_faces`
VisiblePixels visible_pixels(const Raster& raster, int first_face, const Points2& uvs,
                             const Triangles& uv_faces, const VisibleOptions& options = {});

}  // namespace atelier
