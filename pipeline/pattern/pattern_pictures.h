#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// Each pattern.svg of the result.
std::string pattern_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
