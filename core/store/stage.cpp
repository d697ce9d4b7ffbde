#include "core/store/stage.h"

#include <algorithm>

namespace atelier {

const Stage* find_stage(std::span<const Stage> stages, std::string_view name) {
  const auto found = std::find_if(stages.begin(), stages.end(),
                                  [&](const Stage& stage) { return stage.name == name; });
  return found == stages.end() ? nullptr : &*found;
}

const Stage* stage_that_makes(std::span<const Stage> stages, std::string_view kind) {
  const auto found = std::find_if(stages.begin(), stages.end(), [&](const Stage& stage) {
    return !kind.empty() &&
           std::find(stage.outputs.begin(), stage.outputs.end(), kind) != stage.outputs.end();
  });
  return found == stages.end() ? nullptr : &*found;
}

}  // namespace atelier
