#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// The skeleton over images, and how well each frame of each tracked sequence is founded.
std::string track_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
