#include "apps/stages.h"

#include <array>

#include "apps/statistics_stage.h"

namespace atelier {
namespace {

constexpr std::array kStages = {
    Stage{.name = "statistics",
          .version = 1,
          .summary = "numbers of a mesh sequence: counts, area, volume, bounds, edges, holes",
          .inputs = {"meshes"},
          .outputs = {"statistics"},
          .options = option_set<StatisticsStageOptions>,
          .run = run_statistics,
          .frame_wise = true},
};

}  // namespace

std::span<const Stage> all_stages() {
  return kStages;
}

}  // namespace atelier
