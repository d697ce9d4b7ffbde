#pragma once

#include <vector>

#include "capture/frame_reader.h"
#include "capture/triangulation.h"
#include "core/finding.h"

namespace atelier {

/// The person with the most confident points of each camera and frame: [frame][camera], in the
/// order of `frames`; no rows where nobody was found.
std::vector<std::vector<Keypoints2d>> main_person(FrameReader& reader,
                                                  const std::vector<int>& frames);

/// What detections say of themselves and of the calibration: points outside their picture,
/// confidences outside [0,1], cameras that see nobody ("keypoints-none"); then, triangulated, a
/// reprojection error that no detector has ("calibration-error"), the cameras it comes from
/// ("camera-off"), a person of a size that nobody has ("person-size": the unit), a camera that fits
/// another moment better ("camera-out-of-sync": how many frames), and an order of points whose
/// limbs are of no length ("keypoint-order"). Nothing is said of what there is too little of.
std::vector<Finding> check_keypoints(FrameReader& reader, const TriangulationOptions& options = {});

}  // namespace atelier
