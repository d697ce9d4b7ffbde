#ifdef ATELIER_HAS_CAPTURE

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/arguments.h"
#include "apps/command.h"
#include "apps/evaluation.h"
#include "apps/exit_code.h"
#include "apps/input_measures.h"
#include "apps/json_text.h"
#include "apps/option_flags.h"
#include "apps/reconstruct_measures.h"
#include "apps/stages.h"
#include "apps/targets.h"
#include "apps/usage_error.h"
#include "capture/capture_measures.h"
#include "core/printable.h"
#include "core/store/result.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

struct EvaluateArguments {
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
};

nlohmann::ordered_json json_of(const Judged& row) {
  nlohmann::ordered_json json = {{"key", row.key}};
  json["value"] = row.value ? nlohmann::ordered_json(*row.value) : nlohmann::ordered_json(nullptr);
  json["unit"] = row.unit;
  json["target"] = row.target;
  json["verdict"] = row.verdict;
  json["why"] = row.why;
  return json;
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

int run(const EvaluateArguments& arguments) {
  if (arguments.workspace.empty() || arguments.truth.empty()) {
    throw UsageError(
        "evaluate takes a WORKSPACE and --truth: atelier evaluate WORKSPACE --truth CAPTURE");
  }
  std::error_code missing;
  if (!fs::equivalent(arguments.workspace, arguments.truth, missing)) {
    require_workspace(all_stages(), arguments.workspace);
  }
  std::vector<Measure> all;
  const auto add = [&](const std::vector<Measure>& measures) {
    all.insert(all.end(), measures.begin(), measures.end());
  };
  add(workspace_measures(arguments.workspace, arguments.truth, arguments.stage));
#ifdef ATELIER_HAS_CAPTURE_MASKS
  if (!arguments.masks.empty()) {
    add(measure_masks(arguments.masks, arguments.truth));
  }
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
  if (!arguments.cameras.empty()) {
    add(measure_gains(arguments.cameras, arguments.truth));
  }
  if (!arguments.surface.empty()) {
    add(measure_surface(arguments.surface, arguments.frame, arguments.truth));
  }
#endif
  const std::vector<Unmeasured> unmeasured =
      unmeasured_stages(arguments.workspace, arguments.truth, arguments.stage);
  const Targets targets = targets_named(arguments.targets, arguments.truth);
  std::vector<Judged> rows;
  if (arguments.check) {
    rows = judged(all, targets, arguments.workspace);
    std::erase_if(rows, [&](const Judged& row) {
      return !arguments.stage.empty() && row.stage != arguments.stage;
    });
    for (Judged& row : rows) {
      for (const Unmeasured& one : unmeasured) {
        row.why = !row.value && row.stage == one.stage ? one.why : row.why;
      }
    }
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
  for (const Unmeasured& one : unmeasured) {
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
  const bool met = std::all_of(all.begin(), all.end(), is_met);
  return arguments.check && !met ? kExitCheckFailed : kExitDone;
}

}  // namespace

Action add_evaluate(CLI::App& parser) {
  auto arguments = std::make_shared<EvaluateArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace,
             "Folder of results; the capture itself measures its detections alone")
      .required();
  add_option(parser, "--truth", arguments->truth, "Synthetic capture that they were made from")
      .type_name("CAPTURE")
      .required();
#ifdef ATELIER_HAS_CAPTURE_MASKS
  add_option(parser, "--masks", arguments->masks,
             "What masks --out made of the capture: masks.iou, against who is there")
      .type_name("FOLDER");
#endif
#ifdef ATELIER_HAS_CAPTURE_SURFACE
  add_option(parser, "--cameras", arguments->cameras,
             "What calibrate-color --out made of the capture: calibration.gain_mean, "
             "calibration.gain_largest")
      .type_name("FILE");
  add_option(parser, "--surface", arguments->surface,
             "Any mesh of what is seen at --frame: surface.chamfer_mm, surface.completeness")
      .type_name("MESH");
  add_option(parser, "--frame", arguments->frame, "Of --surface [0]").type_name("N");
#endif
  add_option(parser, "--stage", arguments->stage,
             "Figures of this stage alone, or of the capture itself [all]")
      .type_name("NAME");
  add_option(
      parser, "--targets", arguments->targets,
      "What figures are judged by; auto: demo where pictures have less than half a megapixel")
      .check(one_of({"auto", "accuracy", "demo"}))
      .type_name("auto|accuracy|demo");
  add_flag(parser, "--json", arguments->json, "One JSON object of figures");
  add_flag(parser, "--check", arguments->check,
           "A table of every target, met, missed or not measured and why; exit with 1 if one is "
           "missed");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier

#endif
