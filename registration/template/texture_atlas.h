#pragma once

#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

struct TextureAtlasOptions {
  double stretch = 0.25;  ///< that 99 hundredths of the area keep below, 0.01 to 1
  int cuts = 12;          ///< at most, beyond those that make charts disks, 0 to 1000
  double gap = 0.01;      ///< between charts, of the atlas's side, 0 to 0.1
};
OptionTable describe(TextureAtlasOptions& options);

/// The mesh with texture coordinates: charts at one scale, none over itself or another, no triangle
/// turned over, in the unit square.
///
/// Charts are what find_seams cuts (a front, a back, and what keeps stretch and overlaps within
/// bounds), laid flat by flatten_panel, turned upright and packed on shelves by height. Throws
/// DataError as check_flattenable, and where charts still lie over themselves.
Mesh with_texture_atlas(const Mesh& mesh, const TextureAtlasOptions& options = {});

/// How good texture coordinates are.
struct AtlasMeasures {
  int charts = 0;
  int flipped = 0;         ///< triangles that are clockwise or have no area
  int overlapping = 0;     ///< pairs of a triangle and the middle of another that it covers
  double stretch_p99 = 0;  ///< by area, larger of s and 1/s less 1, at the scale of least error
  double used = 0;         ///< share of the unit square
};

/// Throws LogicError for a mesh without texture coordinates.
AtlasMeasures measure_atlas(const Mesh& mesh);

}  // namespace atelier
