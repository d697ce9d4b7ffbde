#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// How far each garment is from the scans, in colours and as a plot over frames.
std::string register_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
