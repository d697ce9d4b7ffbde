#pragma once

#include <span>
#include <vector>

#include "core/store/stage.h"
#include "pipeline/stages/stages.h"

namespace atelier::fixtures {

/// Stages of a fixture that make results in the name of the program's own, with the versions that
/// those have: with others their results would be outdated.
inline std::vector<Stage> with_program_versions(std::span<const Stage> stages) {
  std::vector<Stage> all(stages.begin(), stages.end());
  for (Stage& stage : all) {
    if (const StageRow* row = find_row(stage.name)) {
      stage.version = row->stage.version;
    }
  }
  return all;
}

}  // namespace atelier::fixtures
