#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/store/stage_events.h"

namespace atelier {

/// Current results of a workspace that were made from another capture.
struct OtherCapture {
  std::string path;                 ///< of that capture, as the first of the results names it
  std::string difference;           ///< between that and the given one (input_difference)
  std::vector<std::string> stages;  ///< in their order, with those made of them
};

/// The current results of a workspace that were made from another capture than a given one: one
/// that is not the same (`is_same_input`), as a capture is that was moved, has grown, lost files or
/// was calibrated again. None where all are of this one. Results that cannot be read are of none.
/// Tells its progress to `events` and throws StopRequested if `events.stop` says so; DataError,
/// EnvironmentError of a capture that cannot be read. Cost: reads every file of the capture where a
/// result was made from another place.
std::optional<OtherCapture> other_capture(const std::filesystem::path& workspace,
                                          const std::filesystem::path& capture,
                                          const StageEvents& events = {});

/// Sets the current results of some stages aside: they stay, but are no longer current, so that
/// nothing reads them, until their stage is run again with the same request or `gc` removes them.
/// Throws EnvironmentError, also where a run works on one of the stages.
void set_aside(const std::filesystem::path& workspace, const std::vector<std::string>& stages);

}  // namespace atelier
