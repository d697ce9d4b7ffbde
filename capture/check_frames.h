#pragma once

#include <functional>
#include <vector>

#include "capture/frame_reader.h"
#include "core/finding.h"
#include "core/options.h"

namespace atelier {

struct FrameCheckOptions {
  int every = 1;        ///< of each camera's frames, this many apart are decoded; all are counted
  double black = 0.01;  ///< mean of an image in sRGB below which it is black
  double saturated = 0.3;  ///< share of pixels at the top above which an image is saturated
  double jump = 0.25;      ///< change of the mean from frame to frame that is an exposure jump
  double blur = 0.25;  ///< sharpness against the camera's median below which an image is blurred
};
OptionTable describe(FrameCheckOptions& options);

/// Without images, masks and labels of the cameras that are held out, which `evaluate` alone
/// opens; their calibration and detections stay.
Dataset without_held_out_pictures(Dataset dataset);

/// Images, masks and labels, one frame of one camera at a time: what does not decode
/// ("image-damaged"), has another size ("image-size"), is missing ("frame-missing",
/// "camera-without-pictures"), is the image before once more ("frame-duplicate"), black, saturated,
/// blurred, or exposed otherwise than before; masks that are empty, full or inverted
/// ("mask-inverted"), labels that no taxonomy has. A finding about many frames of a camera is
/// reported once, with the first and the number. A held-out camera may have no image. `told(done,
/// total)` is called after each image.
std::vector<Finding> check_frames(FrameReader& reader, const FrameCheckOptions& options = {},
                                  const std::function<void(int done, int total)>& told = {});

}  // namespace atelier
