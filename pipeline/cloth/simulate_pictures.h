#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// A strip of frames, and what each simulated frame came to as plots.
std::string simulate_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
