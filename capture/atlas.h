#pragma once

#include "core/image.h"
#include "core/mesh.h"

namespace atelier {

/// Where each texel of a mesh's texture lies on its surface.
struct Atlas {
  Image position;         ///< [N,N,3] metres; texels outside every chart have the nearest chart's
  ImageOf<char> covered;  ///< [N,N] 1 where the texel's centre is inside a chart
};

/// Rasterises the uv charts of a mesh into `resolution` squared texels (v up: row 0 is v = 1) and
/// grows them outward by 8 texels, so that filtering at seams finds no holes. Throws LogicError for
/// a mesh without uvs or a resolution outside [16, 16384]. O(texels).
Atlas mesh_atlas(const Mesh& mesh, int resolution);

}  // namespace atelier
