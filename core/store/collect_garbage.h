#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/store/stage.h"

namespace atelier {

/// One thing in a workspace that nothing needs.
struct Garbage {
  std::filesystem::path path;
  std::string what;        ///< "a result that is no longer current", "unfinished work of 12 frames"
  std::int64_t bytes = 0;  ///< that removing it gives back
  std::string kept;        ///< why it is left: "the stage is running", "it is being read",
                           ///< "a newer atelier wrote it"; else ""
  bool removed = false;    ///< false after a dry run, or where it is kept
};

/// Removes unfinished work and results that are no longer current from the stages' folders of a
/// workspace. A stage that is running, and a result that is being read, are left; so is everything
/// of a stage without a current result, every result beside a current one that is damaged,
/// every one that a newer program wrote, and every folder and file that no stage made. Throws
/// DataError if the workspace is missing or no stage has run in it, EnvironmentError if something
/// cannot be looked at or removed.
std::vector<Garbage> collect_garbage(std::span<const Stage> stages,
                                     const std::filesystem::path& workspace, bool dry_run);

}  // namespace atelier
