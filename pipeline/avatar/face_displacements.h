#pragma once

#include <string>
#include <vector>

#include "capture/keypoints2d.h"

namespace atelier {

/// Places of the points of a face among a schema's keypoints ("face_0", ...); none where it has
/// none.
std::vector<int> face_keypoints(const std::vector<std::string>& names);

/// How a face differs from its mean in each frame: every point off its mean place once the head's
/// motion is taken away, cm, at most 3. That motion is the rigid one (Kabsch 1976) of the bridge of
/// the nose and the corners of the eyes where the 68 points of the iBUG order are given and four of
/// these are found, else of all points. 0 of points that were not found, and of frames with fewer
/// than four.
/// @param faces  [F] of [K,4] m and confidence, above 0 where a point was found
/// @return [F] of [3K]
std::vector<std::vector<float>> face_displacements(const std::vector<Keypoints3d>& faces);

}  // namespace atelier
