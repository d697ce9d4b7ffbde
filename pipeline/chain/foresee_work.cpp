#include "pipeline/chain/foresee_work.h"

#include "core/error.h"
#include "core/store/digest_meter.h"
#include "core/store/input_errors.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "pipeline/chain/time_left.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

/// Of a stage that needs a result which is not there, or is recomputed.
ForeseenStage unplanned_stage(const Chain& chain, std::string_view needed) {
  for (std::size_t k = 0; k < chain.foreseen.size(); ++k) {
    const RunStageAccount& maker = chain.account.stages[k];
    if (maker.stage != needed) {
      continue;
    }
    if (chain.foreseen[k].cannot) {
      return {"cannot run",
              {"it reads the result of " + maker.stage + ", which cannot run"},
              false,
              true};
    }
    if (maker.end == "not asked for") {
      return {
          "cannot run",
          {"no result of " + maker.stage + ", which --from " + chain.request.from + " leaves out"},
          false,
          true};
    }
  }
  return {"would run", {"after " + std::string(needed)}, true};
}

/// What the current result of a stage says against its input; "" where it cannot be read.
std::string errors_of_result(const Chain& chain, const Stage& stage) {
  const std::filesystem::path folder = chain.request.places.workspace / stage.name;
  const auto current = current_name(folder);
  try {
    return current ? input_errors_text(stage, read_manifest(folder / *current, stage.name)) : "";
  } catch (const DataError&) {
    return "";
  }
}

/// Of a stage that finds its inputs.
ForeseenStage planned_stage(const Chain& chain, std::size_t i, bool earlier,
                            const PlanOfStage& plan_of) {
  const StagePlan plan = plan_of(run_steps()[i]->stage, chain_request(chain, i, false));
  if (plan.state == StagePlan::State::Done) {
    const std::string errors = errors_of_result(chain, run_steps()[i]->stage);
    std::vector<std::string> why;
    if (!errors.empty()) {
      why.push_back("its result says that the capture has errors, or shows too little: " + errors);
    }
    if (earlier || why.empty()) {
      why.emplace_back(earlier ? "unless an earlier stage's result changes" : "");
    }
    return {"would do nothing", why, earlier};
  }
  return {plan.state == StagePlan::State::Resume ? "would go on" : "would run", plan.reasons, true};
}

/// Of a stage whose predecessors are foreseen.
ForeseenStage foreseen_stage(const Chain& chain, std::size_t i, const PlanOfStage& plan) {
  const StageRow& step = *run_steps()[i];
  bool earlier = false;
  const std::vector<std::string_view> all_needed = needed_stages(step, chain.facts);
  for (const std::string_view needed : all_needed) {
    if (!has_current_result(chain, std::string(needed))) {
      return unplanned_stage(chain, needed);
    }
    earlier = earlier || is_foreseen_to_work(chain, needed);
  }
  const std::vector<std::string_view> all_read = optional_stages(step);
  for (const std::string_view read : all_read) {
    if (is_foreseen_to_work(chain, read) && !has_current_result(chain, std::string(read))) {
      return {"would run", {"after " + std::string(read)}, true};
    }
    earlier = earlier || is_foreseen_to_work(chain, read);
  }
  if (step.chain->input != nullptr) {
    const std::string made = "its input is made of earlier results";
    if (!has_current_result(chain, std::string(step.stage.name)) || earlier) {
      return {"would run", {made}, true};
    }
    const std::vector<std::string> changes = option_changes(chain, i);
    return changes.empty() ? ForeseenStage{"would check its result", {made}, false}
                           : ForeseenStage{"would run", changes, true};
  }
  try {
    return planned_stage(chain, i, earlier, plan);
  } catch (const NewerManifestError&) {
    throw;
  } catch (const DataError& error) {
    for (const auto& makers : {all_needed, all_read}) {
      for (const std::string_view maker : makers) {  // damaged, and recomputed before this one
        if (is_foreseen_to_work(chain, maker) &&
            is_inside(error.file, chain.request.places.workspace / maker)) {
          return unplanned_stage(chain, maker);
        }
      }
    }
    throw;
  }
}

}  // namespace

void foresee_work(Chain& chain, const PlanOfStage& plan) {
  bool anew = false;  // something that the next stage may read
  for (std::size_t i = 0; i < chain.account.stages.size(); ++i) {
    ForeseenStage one;
    if (chain.account.stages[i].end.empty()) {
      try {
        one = foreseen_stage(chain, i, plan);
      } catch (const StopRequested&) {
        throw;
      } catch (const std::exception&) {
        if (chain.request.dry_run) {
          throw;
        }
        one.works = true;
      }
    }
    if (one.works) {  // told now rather than behind hours of other stages
      StageRequest request = chain_request(chain, i, false);
      if (anew) {
        request.workspace.clear();
      }
      require_startable(run_steps()[i]->stage, request);
      one.warnings = previewed_warnings(run_steps()[i]->stage, request);
      anew = true;
    }
    chain.foreseen.push_back(std::move(one));
  }
}

bool is_foreseen_to_work(const Chain& chain, std::string_view stage) {
  for (std::size_t i = 0; i < chain.foreseen.size(); ++i) {
    if (chain.account.stages[i].stage == stage) {
      return chain.foreseen[i].works;
    }
  }
  return false;
}

double chain_pace(const Chain& chain, std::size_t now, double seconds) {
  std::vector<StageTime> times;
  for (std::size_t i = 0; i < chain.account.stages.size(); ++i) {
    const RunStageAccount& one = chain.account.stages[i];
    if (one.end == "done" && is_foreseen_to_work(chain, one.stage)) {
      times.push_back({one.expected, one.seconds});
    } else if (i == now) {
      times.push_back({one.expected, seconds});
    }
  }
  return run_pace(times);
}

double seconds_after(const Chain& chain, std::size_t i, double seconds) {
  double rest = 0;
  for (std::size_t k = i + 1; k < chain.account.stages.size(); ++k) {
    const RunStageAccount& one = chain.account.stages[k];
    rest += one.end.empty() && is_foreseen_to_work(chain, one.stage) ? one.expected : 0;
  }
  return chain_pace(chain, i, seconds) * rest + expected_report_seconds(chain);
}

double expected_report_seconds(const Chain& chain) {
  if (!writes_report(chain.request)) {
    return 0;
  }
  std::vector<std::string> shown;
  for (const RunStageAccount& one : chain.account.stages) {
    const bool to_come = one.end.empty() && is_foreseen_to_work(chain, one.stage);
    if (to_come || has_current_result(chain, one.stage)) {
      shown.push_back(one.stage);
    }
  }
  return chain.report_pace * expected_report_seconds(chain.facts, shown);
}

}  // namespace atelier
