#pragma once

#include <string_view>

#include "core/measure.h"

namespace atelier {

/// A metric of a stage that says by itself, without a ground truth, whether the result can be
/// relied on: what the report shows of a real capture.
struct KeyFigure {
  std::string_view metric;  ///< one of Stage::metrics
  std::string_view words;   ///< what it is, a noun phrase that stands alone: "distance of the body
                            ///< from the scans"
  Measure::Side side = Measure::Side::AtMost;
  double limit = 0;  ///< in the metric's unit; a result beyond it is to be looked at (our choice)
};

}  // namespace atelier
