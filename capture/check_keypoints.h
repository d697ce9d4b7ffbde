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
  Triangulation found;            ///< of that person; no frames where nothing could be said
  bool calibration_fits = false;  ///< the points meet in space: `found` can be built on
};

/// Defects of detections and of the calibration that detections reveal: files that are damaged,
/// points outside their image, confidences outside [0,1], cameras that see nobody
/// ("keypoints-none"); then, triangulated, how all cameras or one of them were misread and the
/// setting that mends it (explain_cameras.h), a person of a size that nobody has ("person-size":
/// the unit), left and right of it in each other's place ("keypoint-sides"), an order of points
/// whose limbs are of no length ("keypoint-order"), half a pixel between calibration and detections
/// ("half-pixel"), points that hardly two cameras see ("coverage-low"). Nothing is said of what
/// there is too little of. Where several people are seen, the one detected best is used.
KeypointCheck check_keypoints(FrameReader& reader, const TriangulationOptions& options = {});

}  // namespace atelier
