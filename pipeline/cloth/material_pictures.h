#pragma once

#include <string>

#include "pipeline/row/report_places.h"

namespace atelier {

/// Of each garment a table: the nearest trial, what is within a tenth of it and within the
/// likelihood's width, and what is taken, with why that is not the nearest; and the grid of trials
/// beside the capture's own picture.
std::string material_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
