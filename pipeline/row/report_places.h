#pragma once

#include <filesystem>
#include <span>

#include "core/store/workspace_status.h"

namespace atelier {

/// Where what a report draws comes from.
struct ReportPlaces {
  std::filesystem::path workspace;
  std::span<const StageStatus> stages;
};

}  // namespace atelier
