#pragma once

#include "core/image.h"
#include "core/mesh.h"

namespace atelier {

struct StitchingOptions {
  double hem = 0.018;        ///< m, how far the cloth is folded over at openings, [0, 0.2]
  double stitch = 0.0035;    ///< m from one stitch to the next, [0.0005, 0.1]
  float fold_shade = 0.90F;  ///< of the albedo where the cloth lies double, [0, 1]
  float line_shade = 0.55F;  ///< of the albedo at seams, edges and stitches, [0, 1]
};

/// The albedo of a sewn garment with what sewing leaves on it (our choice): a hem folded over at
/// each opening with a row of stitches, and a fine dark line along each seam. Openings are edges of
/// one face; seams are edges of two faces whose texture is torn between them. `metres` is the
/// length of the texture's side on the cloth. Throws LogicError for a mesh without texture
/// coordinates or options out of range. Linear in the length of the edges.
Image with_stitching(const Image& albedo, const Mesh& garment, double metres,
                     const StitchingOptions& options = {});

}  // namespace atelier
