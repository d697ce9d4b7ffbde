#include "pipeline/chain/run_chain.h"

#include <algorithm>

#include "core/parallel.h"
#include "core/store/stage.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

using Names = std::vector<std::string_view>;

constexpr double kPageSeconds = 0.3;  // of a report on nothing

int looked_at(const StageCost& cost, const CaptureFacts& facts) {
  return cost.unmasked ? facts.pictured_frames : facts.masked_frames;
}

double expected_seconds(const StageCost& cost, int looked_at, const CaptureFacts& facts,
                        int cores) {
  constexpr double kMeasuredCores = 2;
  const double seconds = cost.seconds +
                         cost.per_picture * facts.megapixels * facts.cameras * looked_at +
                         cost.per_frame * facts.frames + cost.per_clothed * facts.clothed_frames;
  return cost.parallel ? seconds * kMeasuredCores / std::max(1, cores) : seconds;
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

std::vector<std::string> step_names() {
  std::vector<std::string> names;
  for (const StageRow* step : run_steps()) {
    names.emplace_back(step->stage.name);
  }
  return names;
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
  return expected_seconds(step, facts, thread_count());
}

double expected_seconds(const StageRow& step, const CaptureFacts& facts, int cores) {
  const StageCost& cost = step.chain->cost;
  return expected_seconds(cost, looked_at(cost, facts), facts, cores);
}

double expected_megabytes(const StageRow& step, const CaptureFacts& facts, int jobs) {
  const StageMemory& memory = step.chain->memory;
  return memory.megabytes + memory.per_picture * facts.megapixels * facts.cameras * jobs;
}

double expected_report_seconds(const CaptureFacts& facts, std::span<const std::string> stages) {
  double seconds = kPageSeconds;
  for (const StageRow* step : run_steps()) {
    if (std::find(stages.begin(), stages.end(), step->stage.name) == stages.end()) {
      continue;
    }
    const ChainPlace& place = *step->chain;
    const auto of = [&](const StageCost& cost) {
      return expected_seconds(cost, looked_at(cost, facts), facts, thread_count());
    };
    seconds += of(place.report_cost) + (facts.synthetic ? of(place.truth_cost) : 0);
  }
  return seconds;
}

}  // namespace atelier
