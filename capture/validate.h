#pragma once

#include <functional>
#include <vector>

#include "capture/check_frames.h"
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

/// Everything that is checked of a capture, errors first: what reading it found, its consent, its
/// cameras (check_cameras), pictures, masks and labels (check_frames), keypoints against the
/// calibration (check_keypoints).
std::vector<Finding> validate(FrameReader& reader, const ValidateOptions& options = {},
                              const std::function<void(int done, int total)>& told = {});

}  // namespace atelier
