#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/store/manifest.h"
#include "core/store/result.h"
#include "core/store/stage.h"

namespace atelier {

/// Work of an interrupted or split run.
struct UnfinishedWork {
  std::string key16;
  std::int64_t frames = 0;  ///< finished ones
};

/// How one stage stands in a workspace.
struct StageStatus {
  enum class State {
    None,        ///< no result
    Unfinished,  ///< no result yet, but frames of an interrupted or split run
    Done,        ///< a sound result
    Outdated,    ///< sound, but made by another version or from files or results that have changed
    Newer,       ///< a newer program wrote it, which alone can read and replace it
    Damaged,  ///< the result does not agree with its manifest, or cannot be told (current-folder)
  };

  std::string stage;
  State state = State::None;
  std::optional<Manifest> manifest;  ///< of the current result, if it can be read
  std::vector<std::string> reasons;  ///< why it is outdated
  bool inputs_changed = false;       ///< one is that what it was made of is no longer the same
  std::vector<Finding> findings;     ///< how it is damaged
  bool running = false;              ///< a run holds its lock now
  std::vector<UnfinishedWork> unfinished;
  std::int64_t older_results = 0;     ///< beside a current one
  std::int64_t older_kept = 0;        ///< of them, what `collect_garbage` leaves
  std::int64_t unlinked_results = 0;  ///< where no link says which of them is current
  const Stage* row = nullptr;         ///< of the table, which outlives this
};

/// "none", "unfinished", "done", "outdated", "newer" or "damaged".
const char* state_name(StageStatus::State state);

/// Every stage of the table in its order. Changes nothing. Inputs from outside are compared by
/// names, sizes and times, and read where one of these differs; with `Check::Digests`, always. One
/// that is gone is a warning: the result is as sound as it was. Throws DataError if the workspace
/// is missing, no folder, or holds no stage's folder; EnvironmentError if it cannot be looked at.
std::vector<StageStatus> workspace_status(std::span<const Stage> stages,
                                          const std::filesystem::path& workspace,
                                          Check check = Check::Sizes);

/// Results that no link names as current, and what to do about it. @param results  1 or more
std::string unlinked_text(std::int64_t results);

}  // namespace atelier
