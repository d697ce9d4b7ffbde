#pragma once

#include <vector>

#include "capture/frame_reader.h"
#include "capture/triangulation.h"
#include "core/finding.h"

namespace atelier {

/// Statistics of detections in a capture, for the page of `validate` and for other checks.
struct KeypointCheck {
  std::vector<Finding> findings;
  std::vector<int> frame_ids;                        ///< [F] of what follows
  std::vector<std::vector<Keypoints2d>> detections;  ///< [F][camera], of the person that counts
  Triangulation found;            ///< of that person; no frames if there is too little data
  bool calibration_fits = false;  ///< reprojection errors are small: `found` is reliable
};

/// Defects of detections and of the calibration that detections reveal: files that are damaged,
/// points outside their image, confidences outside [0,1], cameras without detections
/// ("keypoints-none"); then, triangulated, a wrong convention of all cameras or one of them, with
/// the setting that corrects it (explain_cameras.h), an implausible size of the person
/// ("person-size": the unit), left and right exchanged ("keypoint-sides"), limbs in proportions
/// that no person has ("keypoint-order"), half a pixel between calibration and detections
/// ("half-pixel"), too many points that one camera alone sees ("coverage-low"). A check without
/// enough data gives no finding. Of several people the one detected best is used.
KeypointCheck check_keypoints(FrameReader& reader, const TriangulationOptions& options = {});

}  // namespace atelier
