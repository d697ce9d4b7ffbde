#include "apps/console/stage_command.h"

#include <charconv>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/console/arguments.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "apps/console/replace_results.h"
#include "apps/console/stage_console.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/file_kind.h"
#include "core/store/digest_meter.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_folder.h"
#include "core/usage_error.h"
#include "core/utf8.h"
#include "core/writable_place.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/chain/startable_without.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

struct StageArguments {
  StageRequest request;
  OptionReader options;
  std::optional<std::string> frames;
  std::optional<std::string> shard;
  std::string device = "cpu";
  bool replace = false;
  bool dry_run = false;
  bool json = false;
  StandAloneWork alone;  ///< what the stage also does without a workspace
};

void require(const std::string& problem) {
  if (!problem.empty()) {
    throw UsageError(problem);
  }
}

/// "" unless a path was given as ''.
std::string empty_problem(const std::string& text) {
  return text.empty() ? "it cannot be '': it takes a path" : "";
}

/// Manifests keep where things lie as text that can be shown.
void require_printable(const std::string& argument, const std::filesystem::path& path) {
  std::error_code ignored;
  const std::filesystem::path real = std::filesystem::weakly_canonical(path, ignored);
  if (!is_printable_utf8(path.string()) || !is_printable_utf8(real.string())) {
    throw UsageError(argument + " cannot be '" + (real.empty() ? path : real).string() +
                     "': the name is not printable UTF-8, which results store it as; rename the "
                     "file or the folder");
  }
}

/// Without a workspace, or with one that is sealed, nothing is kept, so nothing is planned, split
/// or done again.
void require_no_stage_flags(const StageArguments& arguments,
                            const std::string& goes = "goes with INPUT and WORKSPACE") {
  const auto given = [&](const char* flag) {
    throw UsageError(std::string(flag) + " " + goes + "; leave it out here");
  };
  if (arguments.dry_run) {
    given("--dry-run");
  }
  if (arguments.frames) {
    given("--frames");
  }
  if (arguments.shard) {
    given("--shard");
  }
  if (arguments.request.force) {
    given("--force");
  }
  if (arguments.replace) {
    given("--replace");
  }
}

/// Runs the stage, or says what it would do. Errors are the caller's.
int work(const Stage& stage, const StageArguments& arguments, StageConsole& console) {
  const StageRequest& request = arguments.request;
  const bool dry_run = arguments.dry_run;
  catch_interrupts();
  require_folder_or_nothing(request.workspace);
  StageEvents events;
  events.progress = [&](const StageProgress& progress) { console.show_progress(progress); };
  events.say = [&](const std::string& line) { console.say(line); };
  events.stop = interrupted;
  if (reads_capture(stage)) {
    replace_results({stage.name, request.input, request.workspace, arguments.replace, dry_run,
                     arguments.json, events},
                    [&](const std::vector<std::string>& aside) {
                      require_startable_without(stage, request, aside);
                    });
  }
  const std::vector<std::string> outdated = outdated_inputs(stage, request);
  if (dry_run) {
    try {
      StagePlan plan = plan_stage(all_stages(), stage, request, events);
      plan.warnings.insert(plan.warnings.end(), outdated.begin(), outdated.end());
      if (plan.state != StagePlan::State::Done) {
        require_folder_place(plan.stage_folder);
      }
      if (plan.state != StagePlan::State::Done || !request.selection.everything()) {
        require_startable(stage, request);
        const std::vector<std::string> more = previewed_warnings(stage, request);
        plan.warnings.insert(plan.warnings.end(), more.begin(), more.end());
      }
      console.show_plan(plan, request.selection);
    } catch (const StopRequested&) {
      end_by_signal();
    }
    return kExitDone;
  }
  if (!request.selection.everything()) {  // a stage without work for any frame would not ask
    require_startable(stage, request);
  }
  for (const std::string& one : outdated) {  // before the work, which may be long, and after it
    console.say("warning: " + one);
  }
  StageReport report = run_stage(all_stages(), stage, request, events);
  report.plan.warnings.insert(report.plan.warnings.end(), outdated.begin(), outdated.end());
  console.show_report(report);
  if (report.end == StageReport::End::Stopped) {
    std::cout.flush();
    end_by_signal();
  }
  // A stage that judges its input and finds errors has done its work, but the input is no good.
  return report.input_errors ? kExitBadData : kExitDone;
}

/// Whether the WORKSPACE is a file, as a sealed one is, or the flags of sealed ones are given.
bool is_of_sealed(const StandAlone* alone, const StageArguments& arguments) {
  const StageRequest& request = arguments.request;
  return alone != nullptr && alone->of_sealed && !request.input.empty() &&
         !request.workspace.empty() &&
         (!arguments.alone.given().empty() ||
          file_kind(request.workspace) == std::filesystem::file_type::regular);
}

int run(const Stage& stage, const StandAlone* alone, StageArguments& arguments) {
  StageRequest& request = arguments.request;
  if (is_of_sealed(alone, arguments)) {
    require_no_stage_flags(arguments, "goes with a WORKSPACE that is a folder");
    return arguments.alone.run({request.input.string(), arguments.options(),
                                arguments.device == "cuda" ? Device::Cuda : Device::Cpu,
                                arguments.json, request.workspace.string(), request.jobs});
  }
  if (alone != nullptr && alone->takes_input && !request.input.empty() &&
      request.workspace.empty()) {
    require_no_stage_flags(arguments);
    return arguments.alone.run(
        {request.input.string(), arguments.options(), Device::Cpu, arguments.json});
  }
  const bool on_files = alone != nullptr && !alone->of_sealed;
  const std::string flag = on_files ? arguments.alone.given() : "";
  if (!flag.empty()) {
    if (!request.input.empty()) {
      const std::string name(stage.name);
      throw UsageError(alone->takes_input
                           ? flag + " goes with INPUT alone: atelier " + name + " INPUT " + flag +
                                 " FILE; with a WORKSPACE leave it out, the result has all of it"
                           : name + " takes INPUT and WORKSPACE, or " + flag +
                                 " and files, not both");
    }
    require_no_stage_flags(arguments);
    return arguments.alone.run({"", arguments.options(),
                                arguments.device == "cuda" ? Device::Cuda : Device::Cpu,
                                arguments.json});
  }
  if (request.input.empty() || request.workspace.empty()) {
    throw UsageError(std::string(stage.name) + " takes INPUT and WORKSPACE: atelier " +
                     std::string(stage.name) + " INPUT WORKSPACE" +
                     (!on_files ? std::string()
                      : alone->takes_input
                          ? "; or INPUT alone"
                          : "; or " + std::string(alone->first_flag) + " and files"));
  }
  request.options = arguments.options();
  request.device = arguments.device == "cuda" ? Device::Cuda : Device::Cpu;
  if (request.device == Device::Cuda && !stage.has_cuda) {
    throw UsageError("--device cannot be 'cuda': " + std::string(stage.name) +
                     " works on the processor alone; leave --device out");
  }
  request.workspace = workspace_place(request.workspace);
  require_stage_places(request.input, request.workspace);
  if (arguments.frames) {
    require(set_frames(request.selection, *arguments.frames));
  }
  if (arguments.shard) {
    require(set_shard(request.selection, *arguments.shard));
  }
  StageConsole console(stage, arguments.json);
  console.set_forced(request.force);
  return work(stage, arguments, console);
}

}  // namespace

void require_folder_or_nothing(const std::filesystem::path& workspace) {
  const std::filesystem::file_type kind = file_kind(workspace);
  if (kind == std::filesystem::file_type::not_found &&
      link_kind(workspace) == std::filesystem::file_type::symlink) {
    throw EnvironmentError(
        "WORKSPACE " + workspace.string(),
        "a broken symbolic link; create the folder that it names, or remove the link");
  }
  if (kind != std::filesystem::file_type::directory &&
      kind != std::filesystem::file_type::not_found) {
    const std::string sealed = unseal_advice(workspace);
    throw UsageError("WORKSPACE cannot be '" + workspace.string() + "': " +
                     (sealed.empty() ? "not a folder; name a folder, or one that is to be made"
                                     : "it is sealed; " + sealed));
  }
}

void require_stage_places(const std::filesystem::path& input,
                          const std::filesystem::path& workspace) {
  require_printable("INPUT", input);
  require_printable("WORKSPACE", workspace);
  StageRequest request;
  request.input = input;
  request.workspace = workspace;
  if (is_inside_input(request)) {
    throw UsageError(
        "WORKSPACE cannot be '" + workspace.string() +
        "': a workspace inside its own input would change it; name a folder elsewhere");
  }
  if (const std::string problem = workspace_problem(all_stages(), workspace); !problem.empty()) {
    throw UsageError("WORKSPACE cannot be '" + workspace.string() + "': " + problem +
                     "; name a new or an empty folder");
  }
}

std::string jobs_problem(const std::string& text) {
  int jobs = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), jobs);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && jobs >= 0 && jobs <= 1024
             ? ""
             : "'" + text.substr(0, 60) + "' is no whole number from 0 to 1024";
}

Action add_stage(CLI::App& parser, const Stage& stage, const StandAlone* alone) {
  auto arguments = std::make_shared<StageArguments>();
  StageRequest& request = arguments->request;
  const StageRow* row = find_row(stage.name);
  add_option(
      parser, "INPUT", [&request](const std::string& text) { request.input = text; },
      row == nullptr ? std::string(StageRow{}.input_help) : std::string(row->input_help))
      .check(empty_problem)
      .required();
  Argument workspace =
      add_option(
          parser, "WORKSPACE", [&request](const std::string& text) { request.workspace = text; },
          alone != nullptr && alone->of_sealed
              ? "Folder of results; created if it is missing; or a sealed one"
              : "Folder of results; created if it is missing")
          .check(empty_problem);
  if (alone == nullptr || alone->of_sealed) {
    workspace.required();
  }
  add_option(parser, "--jobs", request.jobs,
             "Number of frames processed at once; 0: one for each processor")
      .check(jobs_problem)
      .type_name("N");
  add_option(parser, "--device", arguments->device, "Device of the computation")
      .check(one_of({"cpu", "cuda"}))
      .type_name(stage.has_cuda ? "cpu|cuda" : "cpu");
  if (stage.frame_wise) {
    add_option(
        parser, "--frames", [arguments](const std::string& text) { arguments->frames = text; },
        "Range of frames to process, a <= frame < b, or frame a alone")
        .type_name("a:b|a:|:b|a");
    add_option(
        parser, "--shard", [arguments](const std::string& text) { arguments->shard = text; },
        "Every n-th frame from the i-th only, for a cluster")
        .type_name("i/n");
  }
  add_flag(parser, "--force", request.force, "Compute the result again although it exists");
  if (reads_capture(stage)) {
    add_flag(parser, "--replace", arguments->replace, kReplaceHelp);
  }
  add_flag(parser, "--dry-run", arguments->dry_run,
           "Report what would be done and why, without doing it");
  add_flag(parser, "--json", arguments->json, "Events as lines of JSON, for programs");
  arguments->options = add_option_flags(parser, stage.options());
  if (alone != nullptr) {
    arguments->alone = alone->add(parser);
  }
  return [arguments, &stage, alone] { return run(stage, alone, *arguments); };
}

}  // namespace atelier
