#pragma once

#include <span>
#include <string>
#include <string_view>

#include "capture/dataset.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "core/camera.h"

namespace atelier {

/// One way in which the files of a camera may be meant otherwise than they were read. `validate`
/// tries them on what does not fit, and names the one that does; the option of that name
/// (layouts/corrections.h) takes it from then on.
struct Reading {
  std::string_view option;  ///< "extrinsics", "distortion", ...: of CorrectionOptions
  std::string_view value;   ///< "inverse", "0.5", ...: what that option is set to
  std::string_view code;    ///< of the finding: "extrinsic-inverted"
  std::string_view what;    ///< of the finding: "its extrinsic is camera-to-world"
  bool alone = false;       ///< is only looked for in single cameras: of all it cannot be told
};

/// Refuses a value of an option of corrections: UsageError that begins with the option's name,
/// which the program replaces by the flag as it was typed: "capture.sync cannot be 'cam9': it takes
/// ...".
[[noreturn]] void refuse_correction(std::string_view option, const std::string& found,
                                    const std::string& expected);

/// Every reading that is looked for, the likelier first.
std::span<const Reading> all_readings();

/// Those of keypoints that were found in images turned otherwise than the files hold them, as
/// programs that follow EXIF turn them: looked for behind turns of the images themselves, which
/// look the same where both are square or turned by half.
std::span<const Reading> turned_keypoint_readings();

/// A camera of the layout's own world (in_file_world) under a value of "extrinsics" (inverse,
/// transposed, position, opengl, inverse_opengl), "distortion" (none, k3_third, times_64, by_64),
/// "intrinsics" (swapped_centre, or a factor on all four), "baseline" (a factor on the translation)
/// or "pixel_shift" (px on the principal point). Throws UsageError (the option) for another value.
Camera read_as(Camera camera, std::string_view option, std::string_view value);

/// The reading that a value of "keypoints" stands for: shares, mirrored, upside_down,
/// swapped_sides, turned_90, turned_180 or turned_270 (found in images that are turned clockwise by
/// that), percent, or a factor on the pixels. Throws UsageError for another value.
KeypointReading keypoint_reading(std::string_view value, int width, int height);

/// Detections as they are meant; what was not found stays 0, 0, 0.
Keypoints2d read_as(Keypoints2d points, const KeypointReading& reading,
                    const KeypointSchema& schema, int width, int height);

}  // namespace atelier
