#include "pipeline/chain/outdated_results.h"

#include <algorithm>
#include <set>
#include <system_error>

#include "core/store/made_of.h"
#include "core/store/result.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Whether `atelier run` can make it, and if so, whether out of other results.
enum class InChain { No, OfCapture, OfResults };

InChain in_chain(const std::string& stage) {
  const StageRow* row = find_row(stage);
  return row == nullptr || !row->chain  ? InChain::No
         : row->chain->input == nullptr ? InChain::OfCapture
                                        : InChain::OfResults;
}

/// The capture that a workspace's results were made from; "CAPTURE" where none says it.
fs::path capture_of(const std::vector<StageStatus>& all) {
  for (const StageStatus& status : all) {
    if (status.manifest) {
      for (const ManifestInput& input : status.manifest->inputs) {
        if (input.kind == "capture") {
          return input.path;
        }
      }
    }
  }
  return "CAPTURE";
}

/// The INPUT with which a stage's result is recomputed: the capture, or what it was made of as it
/// is now, where results were handed over (`refine`).
fs::path own_input(const StageStatus& own, const fs::path& workspace, const fs::path& capture) {
  for (const ManifestInput& input : own.manifest->inputs) {
    if (input.kind == "capture" || input.kind != own.row->inputs.front()) {
      continue;
    }
    const std::vector<ResultName> behind = results_behind(workspace, input.path);
    if (behind.empty()) {
      return input.path;
    }
    const ResultName& made_of = behind.front();
    std::error_code ignored;
    const fs::path result =
        fs::weakly_canonical(workspace, ignored) / made_of.stage / made_of.key16;
    const fs::path within = fs::path(input.path).lexically_relative(result);
    const fs::path current = workspace / made_of.stage / "current";
    return within == "."             ? current
           : *within.begin() == ".." ? fs::path(input.path)  // a folder made of results
                                     : current / within;
  }
  return capture;
}

/// Results by which a stage is made: as its manifest says, or of one without a result all that its
/// row reads.
std::vector<std::string> made_by(const StageStatus& status, const fs::path& workspace) {
  std::vector<std::string> makers;
  if (status.manifest) {
    for (const ManifestInput& input : status.manifest->inputs) {
      makers.push_back(input.stage);
      for (const ResultName& made_of : results_behind(workspace, input.path)) {
        makers.push_back(made_of.stage);
      }
    }
    return makers;
  }
  const StageRow* row = find_row(status.stage);
  if (row != nullptr && row->chain) {
    CaptureFacts facts;
    facts.clothed_frames = 1;
    const std::vector<std::string_view> needed = needed_stages(*row, facts);
    makers.assign(needed.begin(), needed.end());
  }
  return makers;
}

enum class Stale { Missing, MissingOrOutdated };

/// A stage and those behind it whose results are outdated, where these count, or, of what is made
/// anew, not there; the last first.
std::vector<const StageStatus*> stale_behind(const std::vector<StageStatus>& all,
                                             const std::string& stage, const fs::path& workspace,
                                             Stale what) {
  std::set<std::string> behind = {stage};  // of which an outdated one is made anew
  std::set<std::string> read = {stage};    // by one that is made anew: it has to be there
  std::vector<const StageStatus*> stale;
  for (auto one = all.rbegin(); one != all.rend(); ++one) {
    const bool missing =
        !one->manifest && read.contains(one->stage) && in_chain(one->stage) != InChain::No;
    const bool outdated = what == Stale::MissingOrOutdated && behind.contains(one->stage) &&
                          one->state == StageStatus::State::Outdated;
    const std::vector<std::string> makers = made_by(*one, workspace);
    if (missing || outdated) {
      stale.push_back(&*one);
    }
    if (missing || outdated || one->stage == stage) {
      read.insert(makers.begin(), makers.end());
    }
    if (missing || (one->manifest && behind.contains(one->stage))) {
      behind.insert(makers.begin(), makers.end());
    }
  }
  return stale;
}

/// Advice about an INPUT that is made of a result that another one has replaced.
std::string replaced_input(const Stage& stage, const StageRequest& request,
                           const ResultName& made_of) {
  const std::string name(stage.name);
  const std::string what = "INPUT " + request.input.string() + " is made from a result of '" +
                           made_of.stage + "' that is no longer the current one; ";
  if (in_chain(name) != InChain::OfResults) {
    return what + "give " + (request.workspace / made_of.stage / "current").string();
  }
  const std::vector<StageStatus> all = workspace_status(all_stages(), request.workspace);
  const std::vector<const StageStatus*> stale =
      stale_behind(all, name, request.workspace, Stale::Missing);
  const std::string from = stale.empty() ? name : stale.back()->stage;
  return what + "run 'atelier run " + capture_of(all).string() + " " + request.workspace.string() +
         " --from " + from + " --to " + name + "' to recompute it";
}

}  // namespace

std::string mending_command(const std::vector<StageStatus>& all, const StageStatus& own,
                            const fs::path& workspace, const fs::path& capture) {
  const std::vector<const StageStatus*> outdated =
      stale_behind(all, own.stage, workspace, Stale::MissingOrOutdated);
  const std::string places = capture.string() + " " + workspace.string();
  const fs::path input = own_input(own, workspace, capture);
  const std::string alone =
      "'atelier " + own.stage + " " + input.string() + " " + workspace.string() + "'";
  const auto chain = [&](const StageStatus& to) {
    const std::string from = outdated.empty() ? to.stage : outdated.back()->stage;
    return "'atelier run " + places + " --from " + from + " --to " + to.stage + "'";
  };
  const InChain how = in_chain(own.stage);
  if (how == InChain::No) {  // `run` leaves it out
    return outdated.size() > 1 ? chain(*outdated[1]) + " and " + alone : alone;
  }
  return outdated.size() > 1 || how == InChain::OfResults ? chain(own) : alone;
}

std::vector<std::string> outdated_results(const fs::path& workspace,
                                          const std::vector<std::string_view>& names) {
  const bool any = std::any_of(names.begin(), names.end(), [&](const std::string_view name) {
    return current_name(workspace / name).has_value();
  });
  std::vector<std::string> sentences;
  if (!any) {
    return sentences;
  }
  const std::vector<StageStatus> all = workspace_status(all_stages(), workspace);
  for (const StageStatus& status : all) {
    if (status.state == StageStatus::State::Outdated &&
        std::find(names.begin(), names.end(), status.stage) != names.end()) {
      sentences.push_back(
          "the result of '" + status.stage + "' is outdated: " + status.reasons.front() + "; run " +
          mending_command(all, status, workspace, capture_of(all)) + " to recompute it");
    }
  }
  return sentences;
}

std::vector<std::string> outdated_inputs(const Stage& stage, const StageRequest& request) {
  std::vector<std::string_view> makers;
  for (const auto* kinds : {&stage.inputs, &stage.optional_inputs}) {
    for (const std::string_view kind : *kinds) {
      const Stage* maker = kind.empty() ? nullptr : stage_that_makes(all_stages(), kind);
      if (maker != nullptr) {
        makers.push_back(maker->name);
      }
    }
  }
  const std::vector<ResultName> behind = results_behind(request.workspace, request.input);
  makers.reserve(makers.size() + behind.size());
  for (const ResultName& made_of : behind) {
    makers.push_back(made_of.stage);
  }
  std::vector<std::string> sentences = outdated_results(request.workspace, makers);
  for (const ResultName& made_of : behind) {
    if (current_name(request.workspace / made_of.stage) != made_of.key16) {
      sentences.push_back(replaced_input(stage, request, made_of));
    }
  }
  return sentences;
}

}  // namespace atelier
