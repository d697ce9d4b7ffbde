#pragma once

#include <string>

#include "core/store/workspace_status.h"
#include "pipeline/row/report_places.h"

namespace atelier {

/// The seen surface from all sides, in clay and with its mean texture, and images beside what is
/// drawn.
std::string avatar_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
