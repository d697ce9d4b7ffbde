#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands/chain_run.h"
#include "apps/commands/run_workflow.h"
#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/failure.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "apps/console/replace_results.h"
#include "apps/console/stage_command.h"
#include "apps/console/standard_streams.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/result.h"
#include "core/store/workspace_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/pictures/report_folder.h"
#include "pipeline/preparation/prepare_recording.h"
#include "pipeline/report/report_file.h"
#include "pipeline/stages/stages.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// A video of the avatar, of the last stage that has one; "" if none has. A stage that this run did
/// not bring to its end may show what it came to long ago.
fs::path video_in(const fs::path& workspace, const std::vector<StageStatus>& stages,
                  const RunAccount& account) {
  const std::span<const StageRow* const> steps = run_steps();
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    const std::string_view stage = (*step)->stage.name;
    if (std::none_of(account.stages.begin(), account.stages.end(), [&](const auto& one) {
          return one.stage == stage && one.end.starts_with("done");
        })) {
      continue;
    }
    for (const StageStatus& status : stages) {
      if (status.stage != stage || !status.manifest) {
        continue;
      }
      for (const ManifestOutput& output : status.manifest->outputs) {
        if (output.path.ends_with(".mp4")) {
          return workspace / stage / "current" / output.path;
        }
      }
    }
  }
  return {};
}

/// A sentence on each outdated result that the chain leaves out and does not recompute (`refine`).
std::vector<std::string> outdated_beside_chain(const fs::path& workspace) {
  std::vector<std::string_view> beside;
  for (const StageRow* row : all_rows()) {
    if (!row->chain) {
      beside.push_back(row->stage.name);
    }
  }
  return outdated_results(workspace, beside);
}

/// The event with which every run ends, of one without a report.
nlohmann::json run_end(const RunAccount& account, double seconds) {
  nlohmann::json json = {{"event", "run_end"},
                         {"seconds", seconds},
                         {"report", ""},
                         {"video", ""},
                         {"outdated", nlohmann::json::array()}};
  json["stages"] = nlohmann::json::array();
  for (const RunStageAccount& one : account.stages) {
    json["stages"].push_back({{"stage", one.stage},
                              {"end", one.end},
                              {"why", one.why},
                              {"expected_seconds", one.expected},
                              {"seconds", one.seconds}});
  }
  return json;
}

/// @param page   the report; "" if it was not written
/// @param video  "" if there is none
void show_end(const RunArguments& arguments, const ChainRun& chain, const fs::path& page,
              const fs::path& video) {
  const RunAccount& account = chain.account();
  const double seconds = chain.seconds();  // with the report
  const std::vector<std::string> outdated = outdated_beside_chain(arguments.places.workspace);
  if (arguments.json) {
    nlohmann::json json = run_end(account, seconds);
    json["report"] = page.string();
    json["video"] = video.string();
    json["outdated"] = outdated;
    show_event(json);
    return;
  }
  std::cout << "run: " << duration_text(seconds) << "\n";
  for (const RunStageAccount& one : account.stages) {
    if (!one.why.empty()) {
      std::cout << "  " << one.stage << " "
                << (one.end == "failed"    ? "FAILED"
                    : one.end == "skipped" ? "was skipped"
                                           : "is " + one.end)
                << ": " << printable(one.why) << "\n";
    }
  }
  for (const std::string& sentence : outdated) {
    std::cout << "  warning: " << printable(sentence) << "\n";
  }
  if (!page.empty()) {
    std::cout << "report: " << printable(page.string()) << "\n";
  }
  if (!video.empty()) {
    std::cout << "video: " << printable(video.string()) << "\n";
  }
}

/// Writes account and report, and says how the run ended. What failed before counts more than a
/// report that cannot be written: a disk that is full is full for both. Where another run is at
/// work, what the workspace comes to is that one's to tell: this one's end is no failure of it.
int report_on(ChainRun& chain, const RunArguments& arguments, const ReportOptions& options) {
  const fs::path& workspace = arguments.places.workspace;
  const bool any = std::any_of(all_stages().begin(), all_stages().end(), [&](const Stage& stage) {
    return current_name(workspace / stage.name).has_value();
  });
  if (!any && chain.exit_code() != kExitDone) {
    return chain.exit_code();  // there is nothing to report on
  }
  if (chain.yields()) {
    show_end(arguments, chain, "", "");
    return chain.exit_code();
  }
  chain.announce_report();
  fs::path page = report_folder(workspace) / "index.html";
  fs::path video;
  try {
    write_run_account(workspace, chain.account());
    std::string truth = chain.facts().synthetic ? arguments.places.capture.string() : "";
    try {
      video = video_in(workspace, write_report(workspace, page, options, truth), chain.account());
    } catch (const DataError& error) {  // of the ground truth: everything else can be shown
      standard_error() << "atelier: no figure against the ground truth: " << printable(error.what())
                       << std::endl;
      video = video_in(workspace, write_report(workspace, page, options, ""), chain.account());
    }
    chain.end_report();
    write_run_account(workspace, chain.account());
  } catch (const std::exception& error) {
    if (chain.exit_code() == kExitDone) {
      throw;
    }
    standard_error() << "atelier: report: " << printable(failure_of(error).text) << std::endl;
    page.clear();
  }
  show_end(arguments, chain, page, video);
  return chain.exit_code();
}

/// A part of the work is a part of one stage, of one that can be divided.
void require_one_stage(const RunArguments& arguments) {
  if (arguments.selection.everything()) {
    return;
  }
  std::string splitting;
  for (const StageRow* step : run_steps()) {
    if (step->chain->splits) {
      splitting += (splitting.empty() ? "" : ", ") + std::string(step->stage.name);
      if (arguments.from == step->stage.name && arguments.to == arguments.from) {
        return;
      }
    }
  }
  throw UsageError(to_string(arguments.selection) + " is a part of one stage: --from STAGE --to " +
                   "STAGE, of " + splitting);
}

/// Where CAPTURE is a recording without calibration, with images of a board beside it: makes the
/// capture that is run, WORKSPACE.recording/capture. Returns false where that is all there is to
/// do.
bool prepare(RunArguments& arguments, const RecordingArguments& recording) {
  const fs::path capture = arguments.places.capture;
  const auto as_it_is = [&] {
    if (!recording.boards.empty()) {
      standard_error() << "atelier: --boards is not used: " << printable(capture.string())
                       << " has a calibration, or images of one camera alone" << std::endl;
    }
    return true;
  };
  if (fs::exists(capture / "capture.toml") || board_folder(capture, recording).empty()) {
    return as_it_is();
  }
  const Dataset dataset = open_dataset(capture);
  if (dataset.calibrated || dataset.cameras.size() < 2) {
    return as_it_is();
  }
  const auto say = [&](const std::string& line) {
    if (arguments.json) {
      show_event({{"event", "prepare"}, {"line", line}});
    } else {
      std::cout << "run: " << printable(line) << std::endl;
    }
  };
  const fs::path folder = arguments.places.workspace.string() + ".recording";
  const std::vector<PreparationStep> steps = preparation_steps(dataset, folder, recording);
  if (arguments.dry_run) {
    for (const PreparationStep& step : steps) {
      say("would make " + step.name + " in " + folder.string());
    }
    return false;
  }
  if (!prepare_recording(dataset, steps, folder, say, interrupted)) {
    end_by_signal();
  }
  arguments.places.capture = folder / "capture";
  return true;
}

/// Jobs of a workflow are whole stages, and write for people.
void require_whole_run(const RunArguments& arguments) {
  if (arguments.jobs != 0) {
    throw UsageError(
        "--workflow takes no --jobs: a job works on as many frames at once as it has "
        "processors; --threads says how many there are in all");
  }
  if (arguments.json || !writes_report(arguments)) {
    throw UsageError(
        "--workflow does all of the stages and the report: without --shard, "
        "--no-report and --json");
  }
}

int run(RunArguments arguments, OptionSet options, const RecordingArguments& recording) {
  const std::vector<std::string> given = given_flags(options.table);
  if (!arguments.material.empty()) {
    set_material(options, arguments.material);
  }
  RunPlaces& places = arguments.places;
  if (places.capture.empty() || places.workspace.empty()) {
    throw UsageError("run takes CAPTURE and WORKSPACE: atelier run CAPTURE WORKSPACE");
  }
  places.workspace = workspace_place(places.workspace);
  require_stage_places(places.capture, places.workspace);
  require_folder_or_nothing(places.workspace);
  const std::span<const StageRow* const> steps = run_steps();
  const auto place = [&](const std::string& name) {
    return std::find_if(steps.begin(), steps.end(),
                        [&](const StageRow* step) { return step->stage.name == name; });
  };
  if (!arguments.from.empty() && !arguments.to.empty() &&
      place(arguments.to) < place(arguments.from)) {
    throw UsageError("--to " + arguments.to + " lies before --from " + arguments.from);
  }
  require_one_stage(arguments);
  if (!arguments.workflow.empty()) {
    require_whole_run(arguments);
  }
  set_thread_count(arguments.threads);
  catch_interrupts();
  const auto begin = std::chrono::steady_clock::now();
  if (!prepare(arguments, recording)) {
    if (arguments.json) {
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
      show_event(run_end({}, taken.count()));
    }
    return kExitDone;
  }
  StageEvents events;
  events.stop = interrupted;
  arguments.set_aside = replace_results({"run", places.capture, places.workspace, arguments.replace,
                                         arguments.dry_run, arguments.json, events},
                                        [&](const std::vector<std::string>& aside) {
                                          ChainRequest without = arguments;
                                          without.set_aside = aside;
                                          without.dry_run = true;
                                          require_feasible(begin_chain(without, options));
                                        });
  ChainRun chain(arguments, options);
  if (!arguments.workflow.empty()) {
    require_feasible(chain.chain());
    run_workflow(arguments, given);
  }
  chain.announce();
  if (arguments.dry_run) {
    require_folder_place(places.workspace);  // the report at least is written there
    const int exit_code = chain.plan();
    if (arguments.json) {
      show_event(run_end(chain.account(), chain.seconds()));
    }
    return exit_code;
  }
  chain.work();
  // The report asks no one whether it is to stop, and `atelier report` makes it again.
  release_interrupts();
  if (interrupted()) {
    end_by_signal();
  }
  if (!writes_report(arguments)) {
    return chain.exit_code();
  }
  return report_on(chain, arguments,
                   options_of<ReportOptions>(options_of<RunOptions>(options).report));
}

/// m. Throws UsageError.
double stature_of(const std::string& text) {
  double stature = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), stature);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() ||
      !(stature >= 0.5 && stature <= 2.5)) {
    throw UsageError("--stature cannot be '" + text.substr(0, 60) +
                     "': it takes metres, 0.5 to 2.5");
  }
  return stature;
}

}  // namespace

Action add_run(CLI::App& parser) {
  auto arguments = std::make_shared<RunArguments>();
  auto recording = std::make_shared<RecordingArguments>();
  const auto to_path = [](fs::path& path) {
    return [&path](const std::string& text) { path = text; };
  };
  add_option(parser, "CAPTURE", to_path(arguments->places.capture), "Capture to read").required();
  add_option(parser, "WORKSPACE", to_path(arguments->places.workspace),
             "Folder of results; created if it is missing")
      .required();
  add_option(parser, "--from", arguments->from, "First stage to run [validate]")
      .check(one_of(step_names()))
      .type_name("STAGE");
  add_option(parser, "--to", arguments->to, "Last stage to run before the report [all]")
      .check(one_of(step_names()))
      .type_name("STAGE");
  add_option(parser, "--jobs", arguments->jobs,
             "Number of frames processed at once; 0: one for each processor")
      .check(jobs_problem)
      .type_name("N");
  add_option(parser, "--threads", arguments->threads,
             "Number of processor cores to use; 0: all of them")
      .check(jobs_problem)
      .type_name("N");
  add_option(parser, "--device", arguments->device, "Device of the stages that support both")
      .check(one_of({"cpu", "cuda"}))
      .type_name("cpu|cuda");
  add_option(parser, "--material", arguments->material,
             "Fabric of all garments instead of a fitted one")
      .type_name("NAME");
  add_option(
      parser, "--shard",
      [arguments](const std::string& text) {
        if (const std::string problem = set_shard(arguments->selection, text); !problem.empty()) {
          throw UsageError(problem);
        }
      },
      "Every n-th frame from the i-th only, of one stage (--from STAGE --to STAGE); no report")
      .type_name("i/n");
  add_flag(parser, "--no-report", arguments->without_report, "Results alone, without the report");
  add_option(parser, "--workflow", arguments->workflow,
             "Jobs of atelier plan by Snakemake instead of this process: on this machine, or as a "
             "profile of Snakemake says")
      .type_name("local|PROFILE");
  add_option(parser, "--boards", recording->boards,
             "Images of a board, for a CAPTURE of images without calibration; a folder of that "
             "name, or calibration/, in CAPTURE by default")
      .type_name("FOLDER");
  add_option(
      parser, "--stature",
      [recording](const std::string& text) { recording->stature = stature_of(text); },
      "Stature of the person in metres, for a CAPTURE of images without calibration: it sets the "
      "scale [1.75]")
      .type_name("METRES");
  add_flag(parser, "--replace", arguments->replace, kReplaceHelp);
  add_flag(parser, "--dry-run", arguments->dry_run,
           "Report what would be done and why, without doing it");
  add_flag(parser, "--json", arguments->json, "Events as lines of JSON, for programs");
  const OptionReader options = add_option_flags(parser, run_options(), "");
  parser.footer(
      "Options of every stage (listed by atelier options, also accepted in TOML files):\n  of a "
      "stage    --STAGE.section.field VALUE, such as --track.exclude none\n  of captures   "
      "--capture.field VALUE, for every stage that has it\n\n" +
      parser.get_footer());
  return [arguments, options, recording] { return run(*arguments, options(), *recording); };
}

}  // namespace atelier
