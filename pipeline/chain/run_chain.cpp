#include "pipeline/chain/run_chain.h"

#include <algorithm>

#include "core/parallel.h"
#include "core/store/stage.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

using Names = std::vector<std::string_view>;

constexpr StageCost kReport{.seconds = 8, .per_picture = 0.1};
/// Figures against the ground truth measure every surface once more.
constexpr StageCost kGroundTruthReport{.seconds = 10, .per_picture = 0.1, .per_clothed = 3};

double expected_seconds(const StageCost& cost, int looked_at, const CaptureFacts& facts) {
  constexpr double kMeasuredCores = 2;
  const double seconds = cost.seconds +
                         cost.per_picture * facts.megapixels * facts.cameras * looked_at +
                         cost.per_frame * facts.frames + cost.per_clothed * facts.clothed_frames;
  return cost.parallel ? seconds * kMeasuredCores / std::max(1, thread_count()) : seconds;
}

/// The stages that make these kinds.
Names makers_of(std::span<const std::string_view> kinds) {
  Names makers;
  for (const std::string_view kind : kinds) {
    const Stage* maker = kind.empty() ? nullptr : stage_that_makes(all_stages(), kind);
    if (maker != nullptr) {
      makers.push_back(maker->name);
    }
  }
  return makers;
}

}  // namespace

std::span<const StageRow* const> run_steps() {
  static const std::vector<const StageRow*> steps = [] {
    std::vector<const StageRow*> some;
    for (const StageRow* row : all_rows()) {
      if (row->chain) {
        some.push_back(row);
      }
    }
    return some;
  }();
  return steps;
}

std::string nothing_for(const StageRow& step, const CaptureFacts& facts) {
  return step.chain->lacks == nullptr ? "" : step.chain->lacks(facts);
}

std::vector<std::string_view> needed_stages(const StageRow& step, const CaptureFacts& facts) {
  Names needed = makers_of(step.stage.inputs);
  if (step.chain->made_of != nullptr) {
    const Names more = step.chain->made_of(facts);
    needed.insert(needed.end(), more.begin(), more.end());
  }
  return needed;
}

std::vector<std::string_view> optional_stages(const StageRow& step) {
  return makers_of(step.stage.optional_inputs);
}

double expected_seconds(const StageRow& step, const CaptureFacts& facts) {
  const StageCost& cost = step.chain->cost;
  return expected_seconds(cost, cost.unmasked ? facts.pictured_frames : facts.masked_frames, facts);
}

double expected_report_seconds(const CaptureFacts& facts) {
  return expected_seconds(facts.synthetic ? kGroundTruthReport : kReport, facts.masked_frames,
                          facts);
}

}  // namespace atelier
