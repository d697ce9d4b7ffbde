#include "pipeline/report/report_file.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "capture/capture_info.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/writable_place.h"
#include "pipeline/evaluation/evaluation.h"
#include "pipeline/evaluation/targets.h"
#include "pipeline/pictures/report_folder.h"
#include "pipeline/pictures/report_summary.h"
#include "pipeline/pictures/run_account.h"
#include "pipeline/report/report_pictures.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

constexpr const char* kDemo =
    "Judged by the ranges of captures of the preset demo (docs/results/demo_ranges.md), which show "
    "that "
    "nothing is broken, not that results are good; the targets of the preset accuracy stand beside "
    "them.";
constexpr const char* kAccuracy = "Judged by the targets of captures of the preset accuracy.";

std::string with_unit(double value, const std::string& unit) {
  char text[60];
  std::snprintf(text, sizeof(text), unit.empty() ? "%.4g" : "%.4g ", value);
  return text + unit;
}

/// The target on `accuracy`. A measure may have a target that it is not judged by: networks of
/// the setting `small` do not reach what those of `standard` must.
std::string accuracy_text(const Judged& row, std::span<const Measure> measures) {
  const auto measure = std::find_if(measures.begin(), measures.end(), [&](const Measure& one) {
    return one.key == row.key && one.side == Measure::Side::None && one.target != 0;
  });
  const auto target = std::find_if(all_targets().begin(), all_targets().end(),
                                   [&](const Target& one) { return one.key == row.key; });
  return measure == measures.end() || target == all_targets().end()
             ? row.target
             : target_text(target->side, measure->target) +
                   " with the setting standard, not judged with small";
}

std::string missed_by(const Judged& row) {
  return row.verdict == "missed" ? with_unit(row.missed_by, row.unit) : "";
}

/// Who was captured, as the capture says; "" where it says nothing, or is gone.
std::string subject_of([[maybe_unused]] std::span<const StageStatus> stages) {
  for (const StageStatus& status : stages) {
    for (const ManifestInput& input :
         status.manifest ? status.manifest->inputs : std::vector<ManifestInput>{}) {
      if (input.kind != "capture") {
        continue;
      }
      try {
        return read_capture_info(input.path).subject;
      } catch (const DataError&) {  // another layout, which names nobody
        return "";
      } catch (const EnvironmentError&) {
        return "";
      }
    }
  }
  return "";
}

/// Figures of the workspace's results against the ground truth of their capture; none without one.
/// @param content  receives those that have a target as gauges, at once what was judged first of
/// each stage and what is missed; and what could not be measured though there is a result
void add_figures(const std::filesystem::path& workspace, const std::string& truth,
                 ReportContent& content) {
  ReportFigures& figures = content.figures;
  std::set<std::string> drawn;  // stages
  const Targets targets = targets_named("auto", truth);
  const bool demo = targets == Targets::Demo;
  figures.judged_by = demo ? kDemo : kAccuracy;
  const WorkspaceFigures measured = workspace_figures(workspace, truth);
  const std::vector<Judged> rows = judged(measured, targets, workspace);
  const std::vector<Judged> sharper = judged(measured, Targets::Accuracy, workspace);
  std::set<std::string> in_table;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Judged& row = rows[i];
    ReportFigure figure{row.key, row.value ? with_unit(*row.value, row.unit) : "-", row.verdict,
                        row.verdict != "missed", row.why};
    figure.range = row.target;
    figure.words = row.words;
    figure.missed_by = missed_by(row);
    if (demo) {
      const std::string by = missed_by(sharper[i]);
      figure.accuracy = accuracy_text(sharper[i], measured.measures) +
                        (by.empty() ? "" : ", missed by " + by) +
                        (sharper[i].verdict == "met" ? ", met" : "");
    }
    in_table.insert(row.key);
    in_table.insert(row.stage);
    const std::string words = row.words.empty() ? row.why : row.words;
    if (row.value && row.side != Measure::Side::None) {
      const bool first = drawn.insert(row.stage).second || row.verdict == "missed";
      content.gauges.push_back({row.key, words, figure.value, row.target, *row.value, row.limit,
                                row.side == Measure::Side::AtLeast, figure.met, first});
    } else if (!row.value && current_name(results_of_stage(workspace, row.stage))) {
      content.unknown.push_back(words + " (" + row.why + ")");
    }
    figures.targets.push_back(std::move(figure));
  }
  for (const Measure& one : measured.measures) {
    if (!in_table.contains(one.key)) {
      const Measure measure = against(one, targets);
      figures.others.push_back({measure.key, with_unit(measure.value, measure.unit),
                                verdict_of(measure), is_met(measure), measure.note});
    }
  }
  for (const Unmeasured& one : measured.unmeasured) {
    if (!in_table.contains(one.stage)) {
      ReportFigure figure{one.stage, "-", "not measured", true, one.why};
      figure.range = target_text(Measure::Side::None, 0);
      figures.targets.push_back(std::move(figure));
    }
  }
}

/// Metrics by which results can be judged by themselves, and what these leave open.
void add_own_figures(std::span<const StageStatus> stages, ReportContent& content) {
  std::vector<std::string> unjudged;
  for (const StageStatus& status : stages) {
    const StageRow* row = find_row(status.stage);
    if (row == nullptr || !status.manifest || status.state == StageStatus::State::Damaged) {
      continue;
    }
    const std::size_t before = content.gauges.size();
    for (const KeyFigure& key : row->key_figures) {
      const auto found = status.manifest->metrics.find(std::string(key.metric));
      if (found == status.manifest->metrics.end()) {
        continue;
      }
      const StageMetric* metric = find_metric(row->stage, key.metric);
      const bool metres = metric != nullptr && metric->unit == "m";
      const double scale = metres ? 1e3 : 1;
      const std::string unit = metres                                      ? "mm"
                               : metric != nullptr && metric->unit == "dB" ? "dB"
                                                                           : "";
      const Measure measure{"", found->second, unit, key.limit, key.side, ""};
      content.gauges.push_back({status.stage + "." + std::string(key.metric),
                                std::string(key.words), with_unit(scale * found->second, unit),
                                target_text(key.side, scale * key.limit), found->second, key.limit,
                                key.side == Measure::Side::AtLeast, is_met(measure)});
    }
    if (content.gauges.size() == before && row->measure != nullptr) {
      unjudged.push_back(status.stage);
    }
  }
  if (std::any_of(stages.begin(), stages.end(),
                  [](const StageStatus& status) { return status.manifest.has_value(); })) {
    content.unknown.push_back("how far the results are from the truth (no ground truth was given)");
  }
  if (!unjudged.empty()) {
    content.unknown.push_back("how good " + some_of(unjudged, unjudged.size()) +
                              (unjudged.size() == 1 ? " is" : " are") +
                              " (no figure has a target without a ground truth)");
  }
}

/// The viewer's page in the folder `view` beside the report, where that is in its own folder:
/// beside others may be the page of another workspace. Where there is none, its place.
ReportView view_beside(const std::filesystem::path& page, std::span<const StageStatus> stages,
                       const std::filesystem::path& workspace) {
  namespace fs = std::filesystem;
  ReportView view;
  std::error_code absent;
  const fs::file_time_type made =
      fs::last_write_time(report_folder(workspace) / "view/index.html", absent);
  if (absent) {
    view.place = (report_folder(workspace.filename()) / "view").generic_string();
    return view;
  }
  if (page.parent_path() != report_folder(workspace)) {
    return view;
  }
  view.page = "view/index.html";
  for (const StageStatus& status : stages) {
    if (status.manifest) {
      const fs::path result =
          results_of_stage(workspace, status.stage) / folder_name(status.manifest->key);
      std::error_code gone;
      view.is_older = view.is_older || fs::last_write_time(result / "manifest.json", gone) > made;
    }
  }
  return view;
}

}  // namespace

std::vector<StageStatus> write_report(const std::filesystem::path& workspace,
                                      const std::filesystem::path& page,
                                      const ReportOptions& options, const std::string& truth) {
  std::vector<StageStatus> stages = workspace_status(all_stages(), workspace, Check::Digests);
  std::optional<FileLock> lock;
  if (page.parent_path() == report_folder(workspace)) {
    lock = lock_report_folder(workspace);
  }
  require_file_place(page);
  require_outside_inputs(page, stages, "--out");
  ReportContent content;
  try {
    content.run = read_run_account(workspace);
  } catch (const DataError& error) {  // the results are as good without it
    content.run_problem = std::string("what the last run came to cannot be read: ") + error.what();
  }
  if (truth.empty()) {
    add_own_figures(stages, content);
  } else {
    add_figures(workspace, truth, content);
  }
  content.drawn = stage_pictures(stages, workspace);
  content.subject = subject_of(stages);
  content.viewer = view_beside(page, stages, workspace);
  write_file_atomically(page, report_page(stages, workspace, options, content));
  return stages;
}

}  // namespace atelier
