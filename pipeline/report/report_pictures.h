#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "core/store/workspace_status.h"

namespace atelier {

/// What a person wants to see of each stage and the stage does not draw itself, as HTML with
/// images inside: where cameras stand and a scan (reconstruct), the skeleton over images
/// (track), the body over images (body), how far each garment is from the scans (register, with a
/// plot over frames), the pattern (flatten), a strip of frames (simulate, with plots over them). By
/// stage; nothing for a stage without a sound result.
///
/// Images of the capture come from where the results say that it was. Where it or a result cannot
/// be read, a sentence says so in the place of the pictures. Throws EnvironmentError.
std::map<std::string, std::string> stage_pictures(std::span<const StageStatus> stages,
                                                  const std::filesystem::path& workspace);

}  // namespace atelier
