#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/store/stage.h"
#include "core/store/stage_events.h"

namespace atelier {

inline constexpr const char* kReplaceHelp =
    "Setting aside of the results of another capture in WORKSPACE, instead of a refusal";

/// Whether a stage's INPUT is a capture, of which a workspace has the results of one.
bool reads_capture(const Stage& stage);

/// Command that is given a capture and a workspace.
struct ReplaceRequest {
  std::string_view command;  ///< "run", or a stage
  std::filesystem::path capture;
  std::filesystem::path workspace;
  bool replace = false;  ///< --replace
  bool dry_run = false;
  bool quiet = false;  ///< --json
  StageEvents events;  ///< while the capture is read
};

/// Refuses a workspace with results of another capture (pipeline/stages/other_capture.h), or sets
/// them aside where --replace asks for it; of a dry run only says so. Returns the stages of what
/// is, or would be, set aside; ends the program where it is interrupted. Throws UsageError;
/// DataError of a capture that cannot be read.
/// @param ready  opens and checks the new capture: called with the stages in question before any of
///               them is set aside, of a dry run as well, it throws where the command could not go
///               on without their results
std::vector<std::string> replace_results(
    const ReplaceRequest& request,
    const std::function<void(const std::vector<std::string>& aside)>& ready);

}  // namespace atelier
