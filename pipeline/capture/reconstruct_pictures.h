#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// Where cameras stand, and a surface from its front and back with its labels.
std::string reconstruct_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
