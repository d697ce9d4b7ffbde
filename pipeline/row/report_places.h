#pragma once

#include <filesystem>
#include <span>

#include "core/store/workspace_status.h"

namespace atelier {

/// Sources of a report's pictures.
struct ReportPlaces {
  std::filesystem::path workspace;
  std::span<const StageStatus> stages;
};

}  // namespace atelier
