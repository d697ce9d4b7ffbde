#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// Held-out views as taken and as the networks render them, and how each training went.
std::string appearance_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
