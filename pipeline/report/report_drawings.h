#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/store/workspace_status.h"

namespace atelier {

/// Where what is drawn comes from.
struct ReportPlaces {
  std::filesystem::path workspace;
  std::span<const StageStatus> stages;
};

/// The rendered images of a stage (report_pictures.h), as HTML; "" of a stage that has none.
/// Throws DataError where a result or the capture cannot be read.
std::string drawings_of(const std::string& stage, const ReportPlaces& places);

}  // namespace atelier
