#pragma once

#include <vector>

#include "capture/detections.h"
#include "capture/keypoint_schema.h"
#include "capture/triangulation.h"
#include "core/camera.h"

namespace atelier {

/// Which detections of several cameras are the same person, and the same from frame to frame, by
/// geometry alone: no appearance, and what a detector says of identities is not asked.
///
/// In each frame every two detections whose rays meet (mean over the joints of 1 - (e/inlier)^2,
/// truncated; Dong et al. 2019 use the epipolar distance, we the reprojection of the midpoint) are
/// a hypothesis; each gathers, from every other camera, the detection that its joints fit best; the
/// one with the most support is a person, its detections are taken away, and the rest is asked
/// again (greedy cliques with the triangulation residual: every two members agree with one point in
/// space, which is what cycle consistency asks for). People of one frame are joined to those of the
/// frame before by where they are in space, where they cannot cross. Our choice throughout.
///
/// Returns [person][F][camera], no rows where a camera does not see somebody, who is seen most
/// first; people of less than a twentieth of the frames of the first are left out as chance.
/// O(F (cameras x people)^2). Throws LogicError for sizes that differ.
std::vector<std::vector<std::vector<Keypoints2d>>> associate_people(
    const std::vector<Camera>& cameras, const Detections& detections, const KeypointSchema& schema,
    const TriangulationOptions& options = {});

}  // namespace atelier
