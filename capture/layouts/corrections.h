#pragma once

#include <map>
#include <string>
#include <string_view>

#include "capture/dataset.h"
#include "core/options.h"

namespace atelier {

/// Corrections of a capture's files by the user, camera by camera: "cam3=-4,cam5=2", or
/// "all=inverse" of every camera. Findings of `validate` say which of them would put a capture
/// right. "": as the files say.
struct CorrectionOptions {
  std::string leave_out;       ///< cameras that are left out: "cam3,cam5"
  std::string sync;            ///< frames by which a camera's numbers are moved: "cam3=-4"
  std::string calibration_of;  ///< camera whose calibration this one has: "cam3=cam5,cam5=cam3"
  std::string extrinsics;      ///< "cam3=inverse": camera_readings.h has the values of these six
  std::string baseline;        ///< "cam3=0.001", factor on the translation
  std::string intrinsics;      ///< "cam3=0.5", factor on focal lengths and principal point
  std::string distortion;      ///< "cam3=k3_third"
  std::string pixel_shift;     ///< "all=0.5", px on the principal point
  std::string turned;          ///< "cam3=90": its images were turned clockwise after calibration
  std::string keypoints;       ///< "cam3=mirrored"
  std::string masks;           ///< "all=inverted"
};
OptionTable describe(CorrectionOptions& options);

/// The corrections of Dataset::corrections, by option; the others are "".
CorrectionOptions corrections_of(const std::map<std::string, std::string>& texts);

/// The error in a value of one of these, "sync" say, whatever cameras a capture has: "cannot be
/// 'cam3=soon': it takes a number of frames"; "" where nothing is. Of other names nothing is said.
std::string correction_problem(std::string_view option, const std::string& text);

/// Calibrations as they are meant, in the layout's own world; cameras that are left out are gone.
/// Throws UsageError (the option as it is typed) for cameras that the capture does not have and for
/// values that there are not.
void correct_cameras(Dataset& dataset, const CorrectionOptions& options);

/// Frames, masks and detections as they are meant, once images and cameras are known. Throws as
/// above.
void correct_frames(Dataset& dataset, const CorrectionOptions& options);

}  // namespace atelier
