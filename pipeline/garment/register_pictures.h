#pragma once

#include <array>
#include <string>

#include "pipeline/row/key_figure.h"
#include "pipeline/row/report_places.h"

namespace atelier {

/// Plots by which a result is judged without a ground truth, with limits as lines.
inline constexpr std::array kRegisterFigures = {
    KeyFigure{"support", "share of the garments near a scan", Measure::Side::AtLeast, 0.75},
    KeyFigure{"scan_rms", "distance of the registered garments from the scans, rms",
              Measure::Side::AtMost, 0.006},
};

/// How far each garment is from the scans, in colours and as a plot over frames.
std::string register_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
