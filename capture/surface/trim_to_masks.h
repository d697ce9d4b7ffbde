#pragma once

#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/mesh.h"

namespace atelier {

/// A surface without what lies beside the subject by the masks of most views that see it. Where it
/// ends, as at a hem, a surface through points goes on for as far as it is kept from the last of
/// them, and windows of stereo reach past the edge: over all that is a centimetre and more.
///
/// Each vertex asks the views that it faces (within 1.3 rad) and that the surface does not hide it
/// from, weighted by the squared cosine, since a mask's own error shows where views graze. Answers
/// are averaged over neighbours; faces of which more than half lies beside go. A vertex that nobody
/// sees stays. Our choice.
/// @param mesh   colours, labels and confidence are kept
/// @param masks  [views] of [H,W], not 0: the subject; an empty one says nothing
/// Throws LogicError for sizes that differ. Cost: vertices x views rays.
Mesh trimmed_to_masks(const Mesh& mesh, const std::vector<Camera>& cameras,
                      const std::vector<ByteImage>& masks);

}  // namespace atelier
