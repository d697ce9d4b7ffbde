#pragma once

#include <filesystem>
#include <span>

#include "core/store/workspace_status.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

/// The current results of a workspace: of the capture its scans, body, garments and avatar with the
/// cameras, where the capture is still there; the simulated garments on their body; the animated
/// avatar. What is damaged or cannot be shown is a note. Throws DataError where there is nothing to
/// show.
ViewScene view_of_workspace(const std::filesystem::path& workspace,
                            std::span<const StageStatus> stages);

}  // namespace atelier
