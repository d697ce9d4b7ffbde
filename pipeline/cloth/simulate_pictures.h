#pragma once

#include <array>
#include <string>

#include "pipeline/row/key_figure.h"
#include "pipeline/row/report_places.h"

namespace atelier {

/// Plots by which a result is judged without a ground truth, with limits as lines.
inline constexpr std::array kSimulateFigures = {
    KeyFigure{"strain_p95", "edge strain of the simulated cloth, 95th percentile",
              Measure::Side::AtMost, 0.1},
};

/// A strip of frames, and what each simulated frame came to as plots.
std::string simulate_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
