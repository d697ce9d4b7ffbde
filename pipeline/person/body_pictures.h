#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// The body over images, and how well each of its frames is founded.
std::string body_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
