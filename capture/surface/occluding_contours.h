#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

struct ContourOptions {
  bool fit = true;        ///< off: skin stays where stereo has it
  double reach = 6;       ///< px, farthest that an image's edge is looked for, [3, 50]
  double noise = 1;       ///< px, of an edge, one in three pixels on its own, [0.05, 50]
  double spread = 0.006;  ///< m, by which stereo is off, [1e-4, 0.1]
  double length = 0.05;   ///< m, over which it is off alike, [0.01, 10]
};
OptionTable describe(ContourOptions& options);

/// A surface moved along its normals to where images show its occluding contours: where a round
/// surface turns away before a background, images tell its place without matching, so that gloss,
/// which wanders with the view and puts stereo inside of limbs (docs/methods/surfaces.md), is out
/// of play.
///
/// Contours are those of the surface with smoothed normals (Hertzmann, "Introduction to 3D
/// non-photorealistic rendering: silhouettes and outlines", 1999), where nothing hides them and the
/// mask has the subject on one side and nobody on the other within `reach`: masks say where to
/// look, not where the edge is, since they are off by more than stereo. The edge is where the
/// image changes most across the contour, of several such places one that is near. The move is
/// the smooth and small field that goes best with all edges, those far off taken for outliers
/// (Geman and McClure), found again from where it led to. Our choice.
/// @param mesh     colours, labels and confidence are kept; normals, if any, recomputed
/// @param cameras  without distortion or with it
/// @param images   [views] of [H,W,3], linear
/// @param masks    [views] of [H,W], not 0: the subject; a view with an empty one says nothing
/// @param movable  [V] not 0: may move; the others stay to the bit
/// Throws LogicError for sizes that differ. Cost: faces x views.
Mesh moved_to_contours(const Mesh& mesh, const std::vector<Camera>& cameras,
                       const std::vector<Image>& images, const std::vector<ByteImage>& masks,
                       const std::vector<std::uint8_t>& movable,
                       const ContourOptions& options = {});

}  // namespace atelier
