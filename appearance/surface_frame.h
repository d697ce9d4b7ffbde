#pragma once

#include <vector>

#include "appearance/texel_map.h"
#include "appearance/transfer_terms.h"
#include "core/image.h"
#include "core/types.h"

namespace atelier {

/// Rows of three floats, one behind the other.
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
/// Light transfer of both sides of points, one behind the other.
using TransferRows = Eigen::Matrix<float, Eigen::Dynamic, 2 * kTransferTerms, Eigen::RowMajor>;

/// A surface in one frame, at its vertices: what geometry maps of any resolution are drawn from.
struct SurfaceFrame {
  int frame_id = 0;
  FloatRows position;  ///< [V,3] metres, world
  FloatRows normal;    ///< [V,3] unit, outward, world; 0 where there is none
  /// [T,3] unit or 0: the world's direction of growing u at each texture coordinate.
  FloatRows tangent;
  /// [V,2*9] light transfer of the outside and of the inside (appearance/occlusion.h); no rows
  /// before it is asked for.
  TransferRows transfer;
  /// [3K] cm that points of a face are off their mean places, of a body whose capture has them; or
  /// empty.
  std::vector<float> face = {};
};

/// Positions, normals (angle-weighted) and tangents (area-weighted, of the faces round each texture
/// coordinate). Throws LogicError unless both kinds of faces have the same rows and name what is
/// there.
SurfaceFrame surface_frame(const Points& vertices, const Triangles& faces, const Points2& uvs,
                           const Triangles& uv_faces, int frame_id = 0);

/// Values of corners [N,C] at each covered texel, [L,C], interpolated. `corners` are the faces that
/// the map was made of, into the values' rows. Throws LogicError unless they fit.
Eigen::MatrixXf texel_values(const TexelMap& map, const Triangles& corners,
                             const Eigen::Ref<const Eigen::MatrixXf>& values);

/// Rows of covered texels as an image [R,R,columns], what is not covered filled from
/// TexelMap::source, 0 where that is not covered either.
Image texture_of(const TexelMap& map, const Eigen::Ref<const Eigen::MatrixXf>& rows);

}  // namespace atelier
