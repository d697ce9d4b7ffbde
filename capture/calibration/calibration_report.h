#pragma once

#include <string>

#include "capture/calibration/calibrate.h"

namespace atelier {

/// A calibration and its standard deviations as text: each camera with its lens, reprojection,
/// coverage and standard deviations, then views left out, by reason, then findings.
std::string calibration_text(const Calibration& calibration);

/// The same for machines, with every rejected view: schema "atelier-calibration" 1
/// (docs/methods/calibration.md).
std::string calibration_json(const Calibration& calibration);

}  // namespace atelier
