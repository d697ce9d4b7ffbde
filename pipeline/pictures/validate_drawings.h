#pragma once

#include <string>
#include <vector>

#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "core/finding.h"

namespace atelier {

/// Where the cameras stand and look, from above and from the side, with the person among them and
/// a grid of metres: one SVG. Cameras of which an error or a warning is said are coloured so.
std::string camera_layout_svg(const Dataset& dataset, const KeypointCheck& keypoints,
                              const std::vector<Finding>& findings);

/// Median reprojection error of each camera and of each joint as bars, and of each camera in each
/// frame as a map: SVG each; "" where there are no keypoints in space.
std::string camera_error_svg(const Dataset& dataset, const KeypointCheck& keypoints);
std::string joint_error_svg(const Dataset& dataset, const KeypointCheck& keypoints);
std::string frame_error_svg(const Dataset& dataset, const KeypointCheck& keypoints);

/// Contact sheet of one frame: each camera's image (a small JPEG in the page), its mask's
/// outline, detections as dots, the joints in space projected back as crosses joined by the
/// skeleton, and the epipolar lines of the nose of the first camera that sees it.
std::string contact_sheet_html(FrameReader& reader, const KeypointCheck& keypoints, int frame_id,
                               const std::vector<Finding>& findings);

}  // namespace atelier
