#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/standard_streams.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/json_text.h"
#include "core/measure.h"
#include "core/printable.h"
#include "core/renamed_options.h"
#include "core/store/result.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "pipeline/capture/input_measures.h"
#include "pipeline/capture/reconstruct_measures.h"
#include "pipeline/evaluation/evaluation.h"
#include "pipeline/evaluation/targets.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct EvaluateArguments {
  KeyArguments keys;
  std::string workspace;
  std::string truth;
  std::string masks;
  std::string cameras;
  std::string surface;
  std::string stage;
  int frame = 0;
  std::string targets = "auto";
  bool json = false;
  bool check = false;
  bool complete = false;
};

/// Whether the table of targets asks for a figure that a result does not give.
bool is_missing(const Judged& row) {
  return !row.value && row.target != target_text(Measure::Side::None, 0);
}

nlohmann::ordered_json json_of(const Judged& row) {
  nlohmann::ordered_json json = {{"key", row.key}};
  json["value"] = row.value ? nlohmann::ordered_json(*row.value) : nlohmann::ordered_json(nullptr);
  json["unit"] = row.unit;
  json["target"] = row.target;
  json["verdict"] = row.verdict;
  json["why"] = row.why;
  return json;
}

/// Refuses a capture of a real person, which has no truth. What a synthetic one lacks is said where
/// it is read.
void require_synthetic(const fs::path& capture) {
  if (fs::is_directory(capture) && !fs::exists(capture / "truth") &&
      !fs::exists(capture / "synthesis.json")) {
    throw DataError(capture.string(), "truth", "none: only synthetic captures have it",
                    "a capture of 'atelier synthesize'");
  }
}

/// A sentence on the first damaged result that a figure is of; "" if there is none. Its readers may
/// not have opened the file that is damaged.
std::string damage_in(const fs::path& workspace, const std::string& stage) {
  const std::vector<std::string> measured = evaluated_stages();
  for (const StageStatus& status : workspace_status(all_stages(), workspace)) {
    if (status.state == StageStatus::State::Damaged &&
        std::find(measured.begin(), measured.end(), status.stage) != measured.end() &&
        (stage.empty() || status.stage == stage)) {
      return "the result of '" + status.stage + "' is damaged" +
             (status.findings.empty() ? "" : ": " + to_string(status.findings.front()));
    }
  }
  return "";
}

void print_table(const std::vector<Judged>& rows) {
  char line[200];
  std::snprintf(line, sizeof(line), "\n%-30s %10s %-3s  %-15s %-12s  %s", "figure", "value", "",
                "target", "verdict", "");
  std::cout << line << "\n";
  std::size_t met = 0;
  std::size_t missed = 0;
  for (const Judged& row : rows) {
    char value[40] = "-";
    if (row.value) {
      std::snprintf(value, sizeof(value), "%.4g", *row.value);
    }
    std::snprintf(line, sizeof(line), "%-30s %10s %-3s  %-15s %-12s  ", row.key.c_str(), value,
                  row.unit.c_str(), row.target.c_str(), row.verdict.c_str());
    std::cout << line << row.why << "\n";
    met += row.verdict == "met" ? 1 : 0;
    missed += row.verdict == "missed" ? 1 : 0;
  }
  std::cout << met << " met, " << missed << " missed, " << rows.size() - met - missed
            << " not measured or not judged\n";
}

int run(EvaluateArguments arguments) {
  if (const std::string now = renamed_stage(arguments.stage); !now.empty()) {
    standard_error() << "warning: stage '" << arguments.stage << "' is now '" << now << "'\n";
    arguments.stage = now;
  }
  if (arguments.stage == "all") {
    arguments.stage.clear();
  }
  if (arguments.workspace.empty() || arguments.truth.empty()) {
    throw UsageError(
        "evaluate takes a WORKSPACE and --ground-truth: atelier evaluate WORKSPACE --ground-truth "
        "CAPTURE");
  }
  if (arguments.complete && !arguments.check) {
    throw UsageError("--complete does nothing without --check");
  }
  const OpenedWorkspace opened(arguments.workspace, arguments.keys);
  arguments.workspace = opened.path();
  std::error_code missing;
  const bool of_capture = fs::equivalent(arguments.workspace, arguments.truth, missing);
  if (!of_capture) {
    require_workspace(all_stages(), arguments.workspace);
  }
  require_synthetic(arguments.truth);
  WorkspaceFigures figures =
      workspace_figures(arguments.workspace, arguments.truth, arguments.stage);
  std::vector<Measure>& all = figures.measures;
  [[maybe_unused]] const auto add = [&](const std::vector<Measure>& measures) {
    all.insert(all.end(), measures.begin(), measures.end());
  };
  if (!arguments.masks.empty()) {
    add(measure_masks(arguments.masks, arguments.truth));
  }
  if (!arguments.cameras.empty()) {
    add(measure_gains(arguments.cameras, arguments.truth));
  }
  if (!arguments.surface.empty()) {
    add(measure_surface(arguments.surface, arguments.frame, arguments.truth));
  }
  const Targets targets = targets_named(arguments.targets, arguments.truth);
  std::vector<Judged> rows;
  if (arguments.check) {
    rows = judged(figures, targets, arguments.workspace);
    std::erase_if(rows, [&](const Judged& row) {
      return !arguments.stage.empty() && row.stage != arguments.stage;
    });
  }
  std::transform(all.begin(), all.end(), all.begin(),
                 [&](const Measure& measure) { return against(measure, targets); });
  nlohmann::ordered_json root = nlohmann::ordered_json::object();
  for (const Measure& measure : all) {
    root[measure.key] = measure.value;
    if (arguments.json) {
      continue;
    }
    char line[200];
    std::snprintf(line, sizeof(line), "%-28s %10.4g %-3s", measure.key.c_str(), measure.value,
                  measure.unit.c_str());
    const std::string verdict = verdict_of(measure);
    std::cout << line << (verdict.empty() ? "" : " ") << verdict << "  " << measure.note << "\n";
  }
  for (const Unmeasured& one : figures.unmeasured) {
    if (arguments.json) {
      root["not_measured"][one.stage] = one.why;
    } else {
      std::cout << one.stage << ": not measured: " << printable(one.why) << "\n";
    }
  }
  if (arguments.json) {
    for (const Judged& row : rows) {
      root["check"].push_back(json_of(row));
    }
    std::cout << json_text(root, 1) << "\n";
  } else if (arguments.check) {
    print_table(rows);
  }
  for (const Unmeasured& one : figures.unmeasured) {
    if (one.damaged) {  // said behind what could be measured, which is one JSON object
      standard_error() << "atelier: " << printable(one.why) << std::endl;
      return kExitBadData;
    }
  }
  if (const std::string damage = of_capture ? "" : damage_in(arguments.workspace, arguments.stage);
      !damage.empty()) {
    standard_error() << "atelier: " << printable(damage) << std::endl;
    return kExitBadData;
  }
  if (!arguments.check) {
    return kExitDone;
  }
  // Figures of the capture say nothing of results: a chain that has not begun would pass by them.
  const bool any = std::any_of(all.begin(), all.end(), [&](const Measure& measure) {
    return measure.side != Measure::Side::None &&
           (of_capture || arguments.stage == "capture" || !measure.key.starts_with("capture."));
  });
  // A stage without targets (`oracle`) has no row that would be missing.
  const bool nothing = std::any_of(
      figures.unmeasured.begin(), figures.unmeasured.end(),
      [&](const Unmeasured& one) { return one.stage == arguments.stage && rows.empty(); });
  if (nothing) {
    standard_error() << "atelier: no figure of '" << arguments.stage << "' was measured"
                     << std::endl;
    return kExitCheckFailed;
  }
  const auto absent = std::count_if(rows.begin(), rows.end(), is_missing);
  if (absent > 0 && (!any || arguments.complete)) {
    standard_error() << "atelier: "
                     << (any ? "not measured: " + counted(absent, "figure")
                             : std::string("no figure was measured"))
                     << " among those with targets" << std::endl;
    return kExitCheckFailed;
  }
  return std::all_of(all.begin(), all.end(), is_met) ? kExitDone : kExitCheckFailed;
}

}  // namespace

Action add_evaluate(CLI::App& parser) {
  auto arguments = std::make_shared<EvaluateArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace,
             "Folder of results; the capture itself evaluates its detections only")
      .required();
  add_key_arguments(parser, arguments->keys);
  add_option(parser, "--ground-truth,--truth", arguments->truth,
             "Synthetic capture that the results were made from")
      .type_name("CAPTURE")
      .required();
  add_option(parser, "--masks", arguments->masks,
             "Folder that masks --out wrote for the capture, evaluated as masks.iou")
      .type_name("FOLDER");
  add_option(parser, "--cameras", arguments->cameras,
             "File that calibrate-color --out wrote for the capture, evaluated as "
             "calibration.gain_mean and calibration.gain_largest")
      .type_name("FILE");
  add_option(parser, "--surface", arguments->surface,
             "Any mesh of the visible surface at --frame, evaluated as surface.chamfer_mm and "
             "surface.completeness")
      .type_name("MESH");
  add_option(parser, "--frame", arguments->frame, "Frame of --surface [0]").type_name("N");
  add_option(parser, "--stage", arguments->stage,
             "Stage to evaluate, or capture for the capture itself [all]")
      .check(one_of(evaluated_stages()))
      .type_name("NAME");
  add_option(
      parser, "--targets", arguments->targets,
      "Set of targets; auto: demo where images have less than half a megapixel, else accuracy")
      .check(one_of({"auto", "accuracy", "demo"}))
      .type_name("auto|accuracy|demo");
  add_flag(parser, "--json", arguments->json, "Figures as one JSON object");
  add_flag(parser, "--check", arguments->check,
           "Table of all targets: met, missed or not measured, and why; exit code 1 if a target is "
           "missed, none was measured or --stage has no result");
  add_flag(parser, "--complete", arguments->complete,
           "With --check, exit code 1 also if a target was not measured");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
