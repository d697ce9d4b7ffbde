#pragma once

#include <string>

namespace atelier {

/// One figure, as `atelier evaluate --json` prints it.
struct Measure {
  std::string key;  ///< "capture.calibration_px"
  double value = 0;
  std::string unit;   ///< "mm", "px", "" for a share
  double target = 0;  ///< what it must not exceed (or fall below)
  enum class Side { None, AtMost, AtLeast } side = Side::None;
  std::string note;  ///< over what it was taken
};

/// True if it has no target, or meets it.
inline bool is_met(const Measure& measure) {
  switch (measure.side) {
    case Measure::Side::AtMost:
      return measure.value <= measure.target;
    case Measure::Side::AtLeast:
      return measure.value >= measure.target;
    case Measure::Side::None:
      break;
  }
  return true;
}

}  // namespace atelier
