#pragma once

#include <string>
#include <vector>

#include "core/image.h"
#include "core/mesh.h"

namespace atelier {

/// Which point of a surface each texel of a square texture shows. Texel (x, y), rows from the top,
/// lies at u = (x + 0.5) / R, v = 1 - (y + 0.5) / R.
struct TexelMap {
  int resolution = 0;        ///< R, texels a side
  ImageOf<int> face;         ///< [R,R] the face that covers the texel's centre, -1: none
  Image barycentric;         ///< [R,R,3] of that face's corners
  std::vector<int> covered;  ///< [T] texels with a face, y * R + x, increasing

  /// [R*R] where each texel gets its value from: itself if it is covered; of an uncovered one near
  /// a seam the texel across the seam, on the chart to which the surface goes on; near any other
  /// border the nearest texel of the chart; itself where no chart is near. Filtering and
  /// convolutions that reach over the edge of a chart then read what is really beside it.
  std::vector<int> source;
};

/// DataError unless every texture coordinate is in [0,1]. @param file  for errors
void check_atlas(const Points2& uvs, const std::string& file = "");

/// Draws the faces into the texture with core's rasteriser. Where charts overlap the lowest face
/// wins. `reach` texels around charts get a source.
///
/// Throws LogicError unless `faces` and `uv_faces` have the same rows and name what is there, and
/// the resolution is 4..8192; texture coordinates outside of [0,1] are a DataError.
TexelMap texel_map(const Triangles& faces, const Points2& uvs, const Triangles& uv_faces,
                   int resolution, int reach = 4);

}  // namespace atelier
