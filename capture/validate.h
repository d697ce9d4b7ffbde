#pragma once

#include <functional>
#include <string>
#include <vector>

#include "capture/check_frames.h"
#include "capture/check_keypoints.h"
#include "capture/frame_reader.h"
#include "capture/triangulation.h"
#include "core/finding.h"
#include "core/options.h"

namespace atelier {

struct ValidateOptions {
  FrameCheckOptions frames;
  TriangulationOptions keypoints;
};
OptionTable describe(ValidateOptions& options);

/// Findings, and the data that they are based on.
struct Validation {
  std::vector<Finding> findings;  ///< errors first
  KeypointCheck keypoints;        ///< the person in space and what each camera saw of it
};

/// Everything that is checked of a capture: what reading it found, its consent, its cameras
/// (check_cameras), images, masks and labels (check_frames), keypoints against the calibration
/// (check_keypoints), masks and labels against keypoints (check_labels).
Validation validate(FrameReader& reader, const ValidateOptions& options = {},
                    const std::function<void(int done, int total)>& told = {});

/// The settings that the findings advise, one for each option, those of several cameras joined:
/// "--capture.sync cam3=2,cam5=1".
std::vector<std::string> settings_of(const std::vector<Finding>& findings);

}  // namespace atelier
