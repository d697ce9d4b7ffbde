#include "core/store/stage.h"

#include <algorithm>
#include <cstdio>

namespace atelier {

void tell(StageRun& run, const std::vector<Finding>& findings, const std::string& whose) {
  for (const Finding& finding : findings) {
    const std::string line = whose + to_string(finding);
    finding.severity == Severity::Note ? run.say(line) : run.warn(line);
  }
}

const Stage* find_stage(std::span<const Stage> stages, std::string_view name) {
  const auto found = std::find_if(stages.begin(), stages.end(),
                                  [&](const Stage& stage) { return stage.name == name; });
  return found == stages.end() ? nullptr : &*found;
}

const StageMetric* find_metric(const Stage& stage, std::string_view name) {
  const auto found = std::find_if(stage.metrics.begin(), stage.metrics.end(),
                                  [&](const StageMetric& metric) { return metric.name == name; });
  return found == stage.metrics.end() ? nullptr : &*found;
}

std::string metric_text(const Stage* stage, std::string_view name, double value) {
  char number[32];
  std::snprintf(number, sizeof number, "%.6g", value);
  const StageMetric* metric = stage == nullptr ? nullptr : find_metric(*stage, name);
  return std::string(number) +
         (metric == nullptr || metric->unit.empty() ? "" : " " + std::string(metric->unit));
}

const Stage* stage_that_makes(std::span<const Stage> stages, std::string_view kind) {
  const auto found = std::find_if(stages.begin(), stages.end(), [&](const Stage& stage) {
    return !kind.empty() &&
           std::find(stage.outputs.begin(), stage.outputs.end(), kind) != stage.outputs.end();
  });
  return found == stages.end() ? nullptr : &*found;
}

}  // namespace atelier
