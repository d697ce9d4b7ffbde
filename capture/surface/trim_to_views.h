#pragma once

#include <vector>

#include "capture/stereo/stereo.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/mesh.h"

namespace atelier {

/// A surface without what most views that see it look past. Where cloth ends, as at a hem, a
/// surface through points goes on for as far as it is kept from the last of them, and windows of
/// stereo reach past the edge: over all that is a centimetre and more.
///
/// Each vertex asks the views that it faces (within 1.3 rad) and that the surface does not hide it
/// from, weighted by the squared cosine, since a mask's own error shows where views graze. A view
/// looks past it where its mask says that nobody is there, or where what it sees, as surely as
/// `min_confidence`, lies more than 2 cm behind: the inside of a skirt below its hem. Answers are
/// averaged over neighbours; faces that more than half look past go. A vertex that nobody sees
/// stays. Our choice.
/// @param mesh   colours, labels and confidence are kept
/// @param masks  [views] of [H,W], not 0: the subject; an empty one says nothing
/// @param maps   [views] of the same instant, or none; one without pixels says nothing
/// Throws LogicError for sizes that differ. Cost: vertices x views rays.
Mesh trimmed_to_views(const Mesh& mesh, const std::vector<Camera>& cameras,
                      const std::vector<ByteImage>& masks, const std::vector<DepthMap>& maps = {},
                      double min_confidence = 0);

}  // namespace atelier
