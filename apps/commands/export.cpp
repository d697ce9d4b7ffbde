#include <ctime>
#include <iostream>
#include <memory>

#include "apps/commands/opened_workspace.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "apps/console/stage_console.h"
#include "capture/layouts/write_layout.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/printable.h"
#include "core/store/consent_refused.h"
#include "core/store/input_errors.h"
#include "core/store/output_place.h"
#include "core/store/workspace_folder.h"
#include "core/store/workspace_status.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/animation/export_result.h"
#include "pipeline/sealing/consent_check.h"
#include "pipeline/sealing/sealed_subject.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEveryStage = "all";
constexpr const char* kNone = "none";

struct ExportArguments {
  std::string workspace;
  std::string out;
  KeyArguments keys;
};

struct ExportOptions {
  std::string stage = kEveryStage;
  ExportFormat format = ExportFormat::Ply;
  std::string cameras = kNone;  ///< a layout of captures, or none
  bool ended_consent = false;   ///< export what is of people whose consent is over
  ConsentUse use;
};

/// Layouts that cameras are exported in.
std::vector<std::string> camera_layouts() {
  std::vector<std::string> layouts = {kNone};
  layouts.insert(layouts.end(), layout_names().begin(), layout_names().end());
  return layouts;
}

OptionTable describe(ExportOptions& options) {
  std::vector<std::string> stages = {kEveryStage};
  for (const Stage& stage : all_stages()) {
    stages.emplace_back(stage.name);
  }
  return OptionTable()
      .add("stage", options.stage, std::move(stages),
           "Stage whose results are exported; all: every stage with results")
      .add("format", options.format,
           {{"ply", ExportFormat::Ply},
            {"obj", ExportFormat::Obj},
            {"glb", ExportFormat::Glb},
            {"usda", ExportFormat::Usda},
            {"h5", ExportFormat::Hdf5}},
           "Format of meshes: ply and obj write a file for each frame; glb, usda and h5 write one "
           "file for a sequence of one topology (usda and h5 leave single meshes as ply)")
      .add("cameras", options.cameras, camera_layouts(),
           "Layout in which the capture's cameras and the images of one instant are exported too; "
           "the capture must still be at its place")
      .add("ended_consent", options.ended_consent,
           "Export of results whose consent has ended, which is refused otherwise")
      .add(describe(options.use));
}

/// Refuses results of people who have not consented to the use, or whose consent is over unless
/// that is allowed. Throws ConsentRefused.
void require_consent_to(const std::vector<const StageStatus*>& chosen,
                        const ExportOptions& options) {
  std::vector<Consent> all;
  for (const StageStatus* status : chosen) {
    add_consent(all, consent_of(*status));
  }
  const double now = options.ended_consent ? 0 : static_cast<double>(std::time(nullptr));
  ConsentAnswer answer = ask_consent(all, options.use, now);
  if (!answer.refusals.empty()) {
    const bool ended_only = ask_consent(all, options.use, 0).refusals.empty();
    answer.refusals.emplace_back(std::string("nothing is exported") +
                                 (ended_only ? "; --ended-consent allows it all the same" : ""));
    throw ConsentRefused(answer.refusals);
  }
  for (const std::string& doubt : answer.doubts) {
    std::cout << "warning: " << printable(doubt) << "\n";
  }
}

/// The capture that a workspace is of. Throws DataError if it is gone.
fs::path capture_of(const std::vector<StageStatus>& all, const std::string& layout) {
  for (const StageStatus& status : all) {
    for (const ManifestInput& input :
         status.manifest ? status.manifest->inputs : std::vector<ManifestInput>{}) {
      if (input.kind == "capture" && fs::exists(input.path)) {
        return input.path;
      }
    }
  }
  throw DataError(
      "", "cameras", "no capture at the path that the workspace's results were made from",
      "the capture in its place, or atelier convert-capture CAPTURE OUT --to " + layout);
}

/// Those results that are to be exported, of which there is one at least, none damaged.
std::vector<const StageStatus*> chosen_results(const std::vector<StageStatus>& all,
                                               const std::string& workspace,
                                               const std::string& stage) {
  std::vector<const StageStatus*> chosen;
  for (const StageStatus& status : all) {
    if (stage != kEveryStage && status.stage != stage) {
      continue;
    }
    if (status.state == StageStatus::State::Newer) {
      throw DataError(workspace, status.stage, "a result that a newer atelier wrote",
                      "one that this atelier can read: export it with the newer one");
    }
    if (status.state == StageStatus::State::Damaged) {
      throw DataError(workspace, status.stage, "a result that is damaged",
                      "a sound one: atelier status --digests says what is damaged, atelier " +
                          status.stage + " INPUT WORKSPACE, with the same arguments recomputes it");
    }
    if (status.manifest) {
      chosen.push_back(&status);
    }
  }
  if (chosen.empty()) {
    throw DataError(workspace, stage == kEveryStage ? "" : stage, "no finished result",
                    "one; atelier status lists what there is");
  }
  return chosen;
}

int run(ExportArguments arguments, const ExportOptions& options) {
  if (arguments.workspace.empty() || arguments.out.empty()) {
    throw UsageError("export takes a WORKSPACE and a folder: atelier export WORKSPACE OUT");
  }
  const OpenedWorkspace opened(arguments.workspace, arguments.keys);
  arguments.workspace = opened.path();
  const fs::path out = workspace_place(arguments.out);
  const std::vector<StageStatus> all =
      workspace_status(all_stages(), arguments.workspace, opened.check_needed());
  require_folder_place(out);
  if (is_inside(out, arguments.workspace)) {
    throw UsageError("OUT lies in the WORKSPACE; name a folder outside of it");
  }
  require_outside_inputs(out, all, "OUT");
  require_outside_captures(out, "OUT");
  const std::vector<const StageStatus*> chosen =
      chosen_results(all, arguments.workspace, options.stage);
  require_consent_to(chosen, options);
  // Whatever would be refused is, before any work.
  for (const StageStatus* status : chosen) {
    require_new_place(out / status->stage, "OUT");
  }
  const fs::path cameras = out / "cameras";
  fs::path capture;
  if (options.cameras != kNone) {
    require_new_place(cameras, "OUT");
    capture = capture_of(all, options.cameras);
  }
  for (const StageStatus& status : all) {
    const std::string errors = status.manifest && status.row != nullptr
                                   ? input_errors_text(*status.row, *status.manifest)
                                   : "";
    if (!errors.empty()) {
      std::cout << "warning: " << status.stage << " ended with errors, " << errors
                << ": the capture has errors, or shows too little, and what is made of it may be "
                << "wrong; atelier report says more\n";
    }
  }
  ExportGuard guard(out);
  const auto say = [](const std::string& lines) { std::cout << lines; };
  for (const StageStatus* status : chosen) {
    for (const std::string& reason : status->reasons) {
      std::cout << status->stage << " is outdated: " << printable(reason) << "\n";
    }
    export_result(*status, arguments.workspace, out, options.format, guard, say);
  }
  if (!capture.empty()) {
    export_cameras(capture, cameras, options.cameras, guard, say);
  }
  opened.log("export", out.string() + ", for " + options.use.purpose);
  guard.release();
  return kExitDone;
}

}  // namespace

OptionSet export_options() {
  return option_set<ExportOptions>();
}

Action add_export(CLI::App& parser) {
  auto arguments = std::make_shared<ExportArguments>();
  add_option(parser, "WORKSPACE", arguments->workspace, "Folder of results, or a sealed one")
      .required();
  add_option(parser, "OUT", arguments->out, "Folder to write to, with one folder for each stage")
      .required();
  add_key_arguments(parser, arguments->keys);
  const OptionReader options = add_option_flags(parser, export_options());
  return [arguments, options] { return run(*arguments, options_of<ExportOptions>(options())); };
}

}  // namespace atelier
