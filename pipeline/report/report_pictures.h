#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "core/store/workspace_status.h"

namespace atelier {

/// Images of each stage in the report that the stage does not draw itself (StageRow::pictures), as
/// HTML with images inside. By stage; nothing for one without images or without a sound result.
///
/// Images of the capture come from where the results say that it was. Where it or a result cannot
/// be read, a sentence says so in the place of the images. Throws EnvironmentError.
std::map<std::string, std::string> stage_pictures(std::span<const StageStatus> stages,
                                                  const std::filesystem::path& workspace);

}  // namespace atelier
