#pragma once

#include <vector>

#include "capture/keypoint_schema.h"
#include "capture/triangulation.h"

namespace atelier {

/// Moves the points of every frame to where the distances that bodies keep (bones, the points of a
/// foot, those of a head) are as they are over the sequence, each by how sure it is: a detector's
/// errors under cloth differ from frame to frame, the lengths of a thigh do not.
///
/// A pair's distance is the mean over frames, weighted by how sure both ends are along it; how well
/// it is kept is what its scatter (by the median) leaves beyond that of its ends, and at least 2
/// mm. A frame is the least squares of places against their covariances and of distances against
/// that, by Gauss-Newton. A pair that fewer than six frames show says nothing; bridged points are
/// left as they are. Covariances become those of the result. Our choice.
void keep_distances(std::vector<SpacePose>& frames, const KeypointSchema& schema);

}  // namespace atelier
