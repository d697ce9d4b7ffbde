#pragma once

#include <array>
#include <string>

#include "pipeline/row/key_figure.h"
#include "pipeline/row/report_places.h"

namespace atelier {

/// Plots by which a result is judged without a ground truth, with limits as lines.
inline constexpr std::array kBodyFigures = {
    KeyFigure{"outside_rate", "share of covered skin outside the clothes", Measure::Side::AtMost,
              0.03},
};

/// The body over images, and how well each of its frames is founded.
std::string body_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
