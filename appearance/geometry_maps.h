#pragma once

#include "appearance/texel_map.h"
#include "core/image.h"
#include "core/types.h"

namespace atelier {

/// What a surface is at each covered texel, one row for each of TexelMap::covered.
struct GeometryMaps {
  Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> position;  ///< [T,3] metres, world
  Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> normal;  ///< [T,3] unit, outward, world
  /// [T,3] unit, orthogonal to the normal: the world's direction of growing u.
  Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> tangent;
};

/// Position, normal (angle-weighted of the vertices, interpolated) and tangent (area-weighted of
/// the faces round each texture coordinate, interpolated) of every covered texel. Throws LogicError
/// unless faces are those that `map` was made of.
GeometryMaps geometry_maps(const Points& vertices, const Triangles& faces, const Points2& uvs,
                           const Triangles& uv_faces, const TexelMap& map);

/// Unit directions from each covered texel to a point (a camera's centre) in the texel's tangent
/// frame: tangent, normal x tangent, normal. [T,3].
Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> view_directions(
    const GeometryMaps& maps, const Eigen::Vector3d& center);

/// Rows of covered texels as a picture [R,R,columns], what is not covered filled from
/// TexelMap::source, 0 where that is not covered either.
Image texture_of(const TexelMap& map,
                 const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& rows);

}  // namespace atelier
