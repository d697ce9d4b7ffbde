#include "pipeline/chain/chain.h"

#include <algorithm>
#include <ctime>
#include <system_error>

#include "capture/layouts/open_dataset.h"
#include "core/device.h"
#include "core/error.h"
#include "core/store/manifest.h"
#include "core/store/result.h"
#include "core/store/utc_time.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/chain/time_left.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

/// A stage's place in the chain. @param without  of no stage
std::size_t place_of(const std::string& stage, std::size_t without) {
  for (std::size_t i = 0; i < run_steps().size(); ++i) {
    if (run_steps()[i]->stage.name == stage) {
      return i;
    }
  }
  return without;
}

/// Sets an option that nobody set, of a stage that the program has.
void suggest_option(Chain& chain, const std::string& name, const std::string& value,
                    const std::string& why) {
  for (const OptionField& field : chain.options.table.fields) {
    if (field.name == name && field.source == "default") {
      const std::string problem = set_option(chain.options.table, name, value, why);
      ATELIER_CHECK(problem.empty(), problem);
      return;
    }
  }
}

/// Takes the times of the workspace's last run of the same capture for what stages take.
void learn_times(Chain& chain) {
  try {
    const auto before = read_run_account(chain.request.places.workspace);
    std::error_code ignored;
    if (!before || !std::filesystem::equivalent(before->capture, chain.account.capture, ignored)) {
      return;
    }
    for (const RunStageAccount& earlier : before->stages) {
      for (RunStageAccount& one : chain.account.stages) {
        if (one.stage == earlier.stage && earlier.seconds > 0 && earlier.end.starts_with("done")) {
          one.expected = earlier.seconds;
        }
      }
    }
    if (before->report_seconds > 0) {
      std::vector<std::string> shown;
      for (const RunStageAccount& earlier : before->stages) {
        if (earlier.end.starts_with("done")) {
          shown.push_back(earlier.stage);
        }
      }
      chain.report_pace = before->report_seconds / expected_report_seconds(chain.facts, shown);
    }
  } catch (const DataError&) {  // the report says it
  }
}

/// Whether no result of this run is of a kind: `fitted_material`, which tells which fabric was
/// asked for.
bool goes_without(const Chain& chain, std::string_view kind) {
  const Stage* maker = stage_that_makes(all_stages(), kind);
  for (std::size_t i = 0; maker != nullptr && i < chain.account.stages.size(); ++i) {
    const RunStageAccount& one = chain.account.stages[i];
    if (one.stage == maker->name) {
      return one.end == "skipped" || (!one.end.empty() && (!has_current_result(chain, one.stage) ||
                                                           !option_changes(chain, i).empty()));
    }
  }
  return maker == nullptr;
}

}  // namespace

bool writes_report(const ChainRequest& request) {
  return !request.without_report && request.selection.everything();
}

Chain begin_chain(const ChainRequest& request, const OptionSet& options) {
  Chain chain;
  chain.request = request;
  chain.options = options;
  chain.facts = capture_facts(request.places.capture,
                              options_of<DatasetOptions>(options_of<RunOptions>(options).capture));
  for (const StageRow* step : run_steps()) {
    const auto suggested = step->chain->suggested;
    for (const SuggestedOption& one :
         suggested == nullptr ? std::vector<SuggestedOption>() : suggested(chain.facts)) {
      suggest_option(chain, std::string(step->stage.name) + "." + std::string(one.name),
                     std::string(one.value), std::string(one.why));
    }
  }
  const double machine = machine_pace();
  chain.report_pace = machine;
  chain.account.capture = request.places.capture.string();
  chain.account.started = utc_text(static_cast<double>(std::time(nullptr)));
  for (const StageRow* step : run_steps()) {
    chain.account.stages.push_back(
        {std::string(step->stage.name), "", "", machine * expected_seconds(*step, chain.facts), 0});
  }
  learn_times(chain);
  skip_stages(chain);
  for (const StageRow* step : run_steps()) {
    const ChainPlace& place = *step->chain;
    if (!request.material.empty() && !place.fabric_from.empty() &&
        goes_without(chain, place.fabric_from)) {
      suggest_option(chain, std::string(step->stage.name) + "." + std::string(place.fabric),
                     request.material, "--material");
    }
  }
  return chain;
}

std::vector<std::size_t> skip_stages(Chain& chain) {
  std::vector<std::size_t> skipped;
  const auto begin = place_of(chain.request.from, 0);
  const auto end = place_of(chain.request.to, run_steps().size() - 1);
  for (std::size_t i = 0; i < chain.account.stages.size(); ++i) {
    RunStageAccount& one = chain.account.stages[i];
    const StageRow& step = *run_steps()[i];
    if (!one.end.empty()) {
      continue;
    }
    if (i < begin || i > end) {
      one.end = "not asked for";
      continue;
    }
    one.why = nothing_for(step, chain.facts);
    for (const std::string_view needed : needed_stages(step, chain.facts)) {
      const RunStageAccount* other = account_of(chain, needed);
      if (one.why.empty() && find_row(needed) == nullptr) {
        one.why =
            "it reads the result of " + std::string(needed) + ", which this build does not have";
      }
      if (one.why.empty() && other != nullptr &&
          (other->end == "skipped" || other->end == "failed")) {
        one.why = "it reads the result of " + other->stage + ", which " +
                  (other->end == "failed" ? "failed" : "is skipped");
      }
    }
    one.end = one.why.empty() ? "" : "skipped";
    if (!one.end.empty()) {
      skipped.push_back(i);
    }
  }
  return skipped;
}

void require_feasible(const Chain& chain) {
  if (const std::string why = why_all_skipped(chain); !why.empty()) {
    throw DataError(chain.request.places.capture.string(), "", "every stage is skipped: " + why,
                    "a capture that some stage can read");
  }
  for (std::size_t i = 0; i < chain.account.stages.size(); ++i) {
    if (!chain.account.stages[i].end.empty()) {
      continue;
    }
    for (const std::string_view needed : needed_stages(*run_steps()[i], chain.facts)) {
      const RunStageAccount* maker = account_of(chain, needed);
      const bool made = maker != nullptr && maker->end.empty();
      if (!made && !has_current_result(chain, std::string(needed))) {
        throw DataError(
            (chain.request.places.workspace / needed).string(), "",
            "no result of this capture, which " + chain.account.stages[i].stage + " reads",
            "a run that makes it: begin --from " + std::string(needed));
      }
    }
    StageRequest request = chain_request(chain, i, false);
    request.workspace.clear();  // of whose results some are another capture's
    require_startable(run_steps()[i]->stage, request);
  }
}

std::string why_all_skipped(const Chain& chain) {
  constexpr std::string_view kJudge = "validate";
  std::string why;
  for (const RunStageAccount& one : chain.account.stages) {
    if (one.end == "not asked for" || one.stage == kJudge) {
      continue;
    }
    if (one.end != "skipped") {
      return "";
    }
    why = why.empty() ? one.why : why;
  }
  return why;
}

const RunStageAccount* account_of(const Chain& chain, std::string_view stage) {
  const auto found = std::find_if(chain.account.stages.begin(), chain.account.stages.end(),
                                  [&](const RunStageAccount& one) { return one.stage == stage; });
  return found == chain.account.stages.end() ? nullptr : &*found;
}

bool has_current_result(const Chain& chain, const std::string& stage) {
  const std::vector<std::string>& aside = chain.request.set_aside;
  return (!chain.request.dry_run || std::find(aside.begin(), aside.end(), stage) == aside.end()) &&
         current_name(chain.request.places.workspace / stage).has_value();
}

StageRequest chain_request(const Chain& chain, std::size_t i, bool make_input) {
  const StageRow& step = *run_steps()[i];
  const Stage& row = step.stage;
  StageRequest request;
  request.workspace = chain.request.places.workspace;
  const auto input = step.chain->input;
  request.input =
      input != nullptr && make_input ? input(chain.request.places) : chain.request.places.capture;
  request.options = stage_options(chain.options, std::string(row.name));
  request.selection = chain.request.selection;
  request.jobs = chain.request.jobs;
  request.device = chain.request.device == "cuda" && row.has_cuda ? Device::Cuda : Device::Cpu;
  return request;
}

std::vector<std::string> option_changes(const Chain& chain, std::size_t i) {
  const Stage& row = run_steps()[i]->stage;
  const StageRequest request = chain_request(chain, i, false);
  const std::filesystem::path folder = request.workspace / row.name;
  Manifest before;
  try {
    before = read_manifest(folder / *current_name(folder), row.name);
  } catch (const NewerManifestError&) {
    throw;
  } catch (const DataError&) {
    return {"the current result is damaged"};
  }
  Manifest now = before;
  now.stage_version = row.version;
  now.device = row.device_keyed ? device_name(request.device) : "";
  now.options.clear();
  for (const OptionField& field : request.options.table.fields) {
    now.options.push_back({field.name, option_json(field), field.source, field.keyed});
  }
  now.canonical_options = canonical_json(request.options.table);
  const bool same = now.stage_version == before.stage_version && now.device == before.device &&
                    now.canonical_options == before.canonical_options;
  return same ? std::vector<std::string>{} : request_changes(before, now);
}

}  // namespace atelier
