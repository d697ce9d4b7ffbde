#include "pipeline/evaluation/evaluation.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "capture/capture_measures.h"
#include "core/error.h"
#include "core/nearest_name.h"
#include "core/store/input_digest.h"
#include "core/store/manifest.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// The capture itself, which is measured like a stage.
constexpr const char* kCapture = "capture";

/// The rows of stages with figures, in the order of their figures.
std::vector<const StageRow*> measured_rows() {
  std::vector<const StageRow*> rows;
  for (const StageRow* row : linked_stage_rows()) {
    if (row->measure != nullptr) {
      rows.push_back(row);
    }
  }
  std::stable_sort(rows.begin(), rows.end(), [](const StageRow* a, const StageRow* b) {
    return a->measure_place < b->measure_place;
  });
  return rows;
}

/// How the workspace stands; nothing of a folder that is none, as a capture is.
std::vector<StageStatus> status_of(const fs::path& workspace) {
  const auto has_result = [&](const Stage& stage) {
    return fs::is_directory(results_of_stage(workspace, stage.name));
  };
  const std::span<const Stage> stages = all_stages();
  return std::any_of(stages.begin(), stages.end(), has_result) ? workspace_status(stages, workspace)
                                                               : std::vector<StageStatus>{};
}

/// Why a stage's figures would say nothing of the workspace as it is: what its result was made of
/// has changed since, or another version of the stage made it or anything that it rests on. With
/// the first such reason and the command that mends it.
std::string outdated_problem(const std::vector<StageStatus>& all, const StageRow& row,
                             const fs::path& workspace, const fs::path& truth) {
  const auto own = std::find_if(
      all.begin(), all.end(), [&](const StageStatus& one) { return one.stage == row.stage.name; });
  if (own == all.end() || own->state != StageStatus::State::Outdated) {
    return "";
  }
  return "outdated: " + own->reasons.front() + "; run " +
         mending_command(all, *own, workspace, truth);
}

/// Refuses the ground truth of another capture than the one that results with figures were made
/// from: `is_same_input`, of the ground truth itself or of one that is the same as that.
void require_own_truth(const std::vector<StageStatus>& all, const fs::path& truth) {
  std::error_code ignored;
  ManifestInput own;
  own.kind = kCapture;
  own.path = fs::weakly_canonical(truth, ignored).string();
  std::vector<std::pair<const StageStatus*, const ManifestInput*>> unknown;
  for (const StageStatus& status : all) {
    const StageRow* row = find_row(status.stage);
    if (row == nullptr || row->measure == nullptr || !status.manifest || status.inputs_changed) {
      continue;  // what has changed may have been of another place
    }
    for (const ManifestInput& input : status.manifest->inputs) {
      if (input.kind == kCapture) {
        unknown.emplace_back(&status, &input);
      }
    }
  }
  std::vector<ManifestInput> known = {own};
  const auto take_known = [&] {
    std::size_t before = 0;
    do {
      before = unknown.size();
      std::erase_if(unknown, [&](const auto& one) {
        const bool same = std::any_of(known.begin(), known.end(), [&](const ManifestInput& other) {
          return is_same_input(other, *one.second);
        });
        if (same) {
          known.push_back(*one.second);
        }
        return same;
      });
    } while (unknown.size() < before);
  };
  take_known();
  if (unknown.empty() || !fs::is_directory(truth)) {  // what is no capture its readers refuse
    return;
  }
  const InputDigest found = digest_of_input(truth);
  own = {kCapture, own.path, found.digest, found.files, found.bytes, "", found.stamp, found.sketch};
  known.push_back(own);
  take_known();
  if (!unknown.empty()) {
    const auto& [status, input] = unknown.front();
    throw DataError(truth.string(), "",
                    "another capture than the one that the result of '" + status->stage +
                        "' was made from: " + input_difference(*input, own),
                    "--ground-truth " + input->path + ", or the results of this one");
  }
}

std::string problem_of(const StageRow& row, const std::vector<StageStatus>& status,
                       const fs::path& workspace, const fs::path& truth) {
  std::string why = outdated_problem(status, row, workspace, truth);
  return !why.empty() || row.problem == nullptr ? why : row.problem(workspace, truth);
}

/// Why a stage cannot be measured that reads a file which cannot be read, and what mends it.
std::string damage_text(const DataError& error, const fs::path& workspace) {
  std::string text = error.what();
  const fs::path file = fs::weakly_canonical(fs::current_path() / error.file);
  if (error.file.empty() || !is_inside(file, workspace) ||
      text.find("run 'atelier ") != std::string::npos) {
    return text;
  }
  const fs::path inside = file.lexically_relative(fs::weakly_canonical(workspace));
  return text + "; run 'atelier " + inside.begin()->string() + "' again";
}

/// Adds what the result of a stage gives, or why it gives nothing.
/// @param asked  for this stage alone: where it has no result, that is said
void add_figures(WorkspaceFigures& all, const StageRow& row, bool asked,
                 const std::vector<StageStatus>& status, const fs::path& workspace,
                 const fs::path& truth) {
  const std::string stage(row.stage.name);
  try {
    if (asked && !current_name(results_of_stage(workspace, stage))) {
      all.unmeasured.push_back(
          {stage, "there is no result of " + stage + "; run 'atelier " + stage + "' first", false});
      return;
    }
    if (std::string why = problem_of(row, status, workspace, truth); !why.empty()) {
      all.unmeasured.push_back({stage, std::move(why), false});
      return;
    }
    const std::vector<Measure> some = row.measure(workspace, truth);
    all.measures.insert(all.measures.end(), some.begin(), some.end());
  } catch (const DataError& error) {
    if (is_inside(error.file, truth)) {
      throw;  // without the ground truth nothing can be measured
    }
    all.unmeasured.push_back({stage, damage_text(error, workspace), true});
  }
}

}  // namespace

std::vector<std::string> evaluated_stages() {
  std::vector<std::string> stages = {kCapture};
  for (const StageRow* row : measured_rows()) {
    stages.emplace_back(row->stage.name);
  }
  return stages;
}

WorkspaceFigures workspace_figures(const fs::path& workspace, const fs::path& truth,
                                   const std::string& stage) {
  WorkspaceFigures all;
  const std::vector<StageStatus> status = status_of(workspace);
  require_own_truth(status, truth);
  bool known = stage.empty() || stage == kCapture;
  if (known) {
    all.measures = measure_capture(truth);
  }
  const std::vector<const StageRow*> rows = measured_rows();
  for (const StageRow* row : rows) {
    const bool asked = stage == row->stage.name;
    known = known || asked;
    if (stage.empty() || asked || stage == row->measured_for) {
      add_figures(all, *row, asked, status, workspace, truth);
    }
  }
  for (const StageRow* row : rows) {
    if (row->comparison != nullptr) {
      if (const std::optional<Measure> one = row->comparison(workspace, all.measures)) {
        all.measures.push_back(*one);
      }
    }
  }
  if (!known) {
    std::string stages;
    const std::vector<std::string> names = evaluated_stages();
    for (const std::string& one : names) {
      stages += (stages.empty() ? "" : ", ") + one;
    }
    const std::string name = stage.substr(0, 80);
    const std::string meant = did_you_mean(name, names);
    throw UsageError("'" + name + "' has no figures" +
                     (meant.empty() ? "; these have: " + stages : meant));
  }
  return all;
}

std::vector<Judged> judged(const WorkspaceFigures& figures, Targets targets,
                           const fs::path& workspace) {
  std::vector<Judged> rows = judged(figures.measures, targets, workspace);
  for (Judged& row : rows) {
    for (const Unmeasured& one : figures.unmeasured) {
      row.why = !row.value && row.stage == one.stage ? one.why : row.why;
    }
  }
  return rows;
}

std::string verdict_of(const Measure& measure) {
  if (measure.side == Measure::Side::None) {
    return "";
  }
  char text[80];
  std::snprintf(text, sizeof(text), "%s (%s %g)", is_met(measure) ? "met" : "MISSED",
                measure.side == Measure::Side::AtMost ? "at most" : "at least", measure.target);
  return text;
}

}  // namespace atelier
