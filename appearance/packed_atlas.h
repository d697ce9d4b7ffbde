#pragma once

#include <vector>

#include "core/mesh.h"

namespace atelier {

/// Texture coordinates of a surface whose charts do not overlap.
struct PackedAtlas {
  Points2 uvs;             ///< [T,2] in [0,1], v up
  Triangles uv_faces;      ///< [F,3] into uvs
  std::vector<int> chart;  ///< [F] the chart of each face, from 0
};

struct PackAtlasOptions {
  int resolution = 256;  ///< texels a side of the smallest texture that it is for, 16..16384
  int margin = 3;        ///< texels that charts keep from each other and from the border, 1..64
};

/// Packs the charts of a mesh (its connected parts in texture space) into the unit square, each at
/// the scale of its surface, so that a texel is as large everywhere: patterns and foreign atlases
/// that tile, leave most of the square empty or have charts of different scales become one that a
/// network's texture can be. Charts keep their shape and are turned as suits (place_shapes.h); more
/// than 64 of them, and those that fit so no better, keep their direction on shelves by falling
/// height. The same mesh gives the same atlas.
///
/// A mesh without texture coordinates is a DataError, as is one with a chart without area.
/// @param mesh  its vertices say how large each chart's surface is
PackedAtlas pack_atlas(const Mesh& mesh, const PackAtlasOptions& options = {});

}  // namespace atelier
