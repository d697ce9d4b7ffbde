#ifdef ATELIER_HAS_CAPTURE

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
#include "apps/reconstruct_measures.h"
#include "apps/stages.h"
#include "apps/usage_error.h"
#include "capture/capture_measures.h"
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
  bool json = false;
  bool check = false;
};

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
  bool met = true;
  nlohmann::ordered_json root = nlohmann::ordered_json::object();
  for (const Measure& measure : all) {
    met = met && is_met(measure);
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
  if (arguments.json) {
    std::cout << json_text(root, 1) << "\n";
  }
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
  add_flag(parser, "--json", arguments->json, "One JSON object of figures");
  add_flag(parser, "--check", arguments->check, "Exit with 1 if a target is missed");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier

#endif
