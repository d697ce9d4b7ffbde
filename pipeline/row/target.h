#pragma once

#include <optional>
#include <string_view>

#include "core/measure.h"

namespace atelier {

inline constexpr std::string_view kNoGroundTruth = "no frame has both a result and ground truth";

/// One figure that a stage's result is judged by, a row of the table of targets.
struct Target {
  std::string_view key;    ///< as `atelier evaluate --json` has it
  std::string_view words;  ///< what it is, a noun phrase that stands alone
  std::string_view unit;   ///< "mm", "" for a share
  Measure::Side side = Measure::Side::AtMost;
  double accuracy = 0;              ///< the target on `accuracy`
  std::optional<double> demo = {};  ///< what the results on `demo` stay within; none: not judged
  /// Why there may be no figure although there is a result, one sentence.
  std::string_view absent = kNoGroundTruth;
  std::string_view stage = "";  ///< whose result is measured; all_targets fills it in
};

}  // namespace atelier
