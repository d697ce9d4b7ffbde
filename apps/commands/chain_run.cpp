#include "apps/commands/chain_run.h"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/console/failure.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "apps/console/standard_streams.h"
#include "core/error.h"
#include "core/io/json_text.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/digest_meter.h"
#include "core/store/file_lock.h"
#include "core/store/flag_command.h"
#include "core/store/run_stage.h"
#include "core/usage_error.h"
#include "pipeline/chain/foresee_work.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/stages/option_rules.h"
#include "pipeline/stages/stages.h"
#include "simulation/material/fabric.h"

namespace atelier {
namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// The one stage with a program of its own: what that lacks (libtorch, memory for networks) the
/// others may well have.
constexpr const char* kAppearanceProgram = "atelier-appearance";

}  // namespace

void show_event(const nlohmann::json& json) {
  std::cout << json_text(json) << std::endl;
}

void set_material(OptionSet& options, const std::string& fabric) {
  if (const std::string problem = one_of(fabric_names())(fabric); !problem.empty()) {
    throw UsageError("--material: " + problem);  // "fitted" is what a search does without it
  }
  for (const StageRow* step : run_steps()) {
    const ChainPlace& place = *step->chain;
    if (place.fabric.empty() || !place.fabric_from.empty()) {
      continue;
    }
    const std::string problem =
        set_option(options.table, std::string(step->stage.name) + "." + std::string(place.fabric),
                   fabric, "--material");
    if (!problem.empty()) {
      throw UsageError("--material: " + problem);
    }
  }
  if (const std::vector<std::string> problems = broken_rules(options.table); !problems.empty()) {
    throw UsageError(problems);
  }
}

ChainRun::ChainRun(const RunArguments& arguments, const OptionSet& options)
    : arguments_(arguments), chain_(begin_chain(arguments, options)) {
  for (std::size_t i = 0; i < chain_.account.stages.size(); ++i) {
    tell_skip(i);
  }
}

/// For machines, where a stage is skipped.
void ChainRun::tell_skip(std::size_t i) const {
  const RunStageAccount& one = chain_.account.stages[i];
  if (arguments_.json && one.end == "skipped") {
    show_event({{"event", "skip"}, {"stage", one.stage}, {"why", one.why}});
  }
}

/// Looks what there is to do; says how far it is.
void ChainRun::foresee() {
  try {
    foresee_work(chain_, [&](const Stage& stage, const StageRequest& request) {
      StageConsole console(stage, false);
      StageEvents events;
      if (!arguments_.json) {  // whose first event is "run"
        events.progress = [&](const StageProgress& progress) { console.show_progress(progress); };
      }
      events.stop = interrupted;
      return plan_stage(all_stages(), stage, request, events);
    });
  } catch (const StopRequested&) {
    end_by_signal();
  }
}

void ChainRun::announce() {
  if (!arguments_.json) {
    std::cout << "run: " << counted(chain_.facts.cameras, "camera") << ", "
              << counted(chain_.facts.frames, "frame") << ", " << chain_.facts.masked_frames
              << " with masks, " << chain_.facts.clothed_frames << " of them clothed" << std::endl;
  }
  foresee();
  double seconds = expected_report_seconds(chain_);
  int stages = 0;
  int working = 0;
  for (const RunStageAccount& one : chain_.account.stages) {
    if (one.end.empty()) {
      ++stages;
      working += is_foreseen_to_work(chain_, one.stage) ? 1 : 0;
      seconds += is_foreseen_to_work(chain_, one.stage) ? one.expected : 0;
    }
  }
  if (arguments_.json) {
    show_event({{"event", "run"}, {"stages", stages}, {"expected_seconds", seconds}});
    return;
  }
  const std::string time =
      "about " + duration_text(seconds) + " on " + counted(thread_count(), "core");
  const bool reports = writes_report(arguments_);
  const auto cannot = std::count_if(chain_.foreseen.begin(), chain_.foreseen.end(),
                                    [](const ForeseenStage& one) { return one.cannot; });
  if (stages == 0) {
    std::cout << "run: no stage is to run: each is skipped, or not asked for" << std::endl;
  } else if (working == 0 && cannot > 0) {
    std::cout << "run: " << cannot << " of " << counted(stages, "stage") << " cannot run"
              << std::endl;
  } else if (working > 0) {
    std::cout << "run: " << working << " of " << counted(stages, "stage") << " to run"
              << (reports ? ", then the report: " : ": ") << time << std::endl;
  } else {
    std::cout << "run: every result of " << counted(stages, "stage") << " is there; ";
    if (!reports) {
      std::cout << (arguments_.dry_run ? "a run would check them" : "they are checked")
                << std::endl;
    } else {
      std::cout << (arguments_.dry_run ? "a run would write the report alone again, "
                                       : "they are checked, and the report is written again, ")
                << time << std::endl;
    }
  }
  for (const RunStageAccount& one : chain_.account.stages) {
    if (one.end == "skipped" && !arguments_.dry_run) {  // whose plan lists them
      std::cout << "run: " << one.stage << " is skipped: " << one.why << std::endl;
    }
  }
}

/// Every stage in its order.
void ChainRun::work() {
  int place = 0;
  const auto asked = std::count_if(chain_.account.stages.begin(), chain_.account.stages.end(),
                                   [](const RunStageAccount& one) { return one.end.empty(); });
  for (std::size_t i = 0; i < chain_.account.stages.size(); ++i) {
    RunStageAccount& one = chain_.account.stages[i];
    if (!one.end.empty()) {
      continue;
    }
    ++place;
    if (!arguments_.json) {
      std::cout << "run: [" << place << " of " << asked << "] " << one.stage;
      if (is_foreseen_to_work(chain_, one.stage)) {
        const double seconds = chain_pace(chain_, i, 0) * one.expected;
        std::cout << ", about " << duration_text(seconds) << "; about "
                  << duration_text(seconds + seconds_after(chain_, i, 0)) << " left in all";
      }
      std::cout << std::endl;
    }
    stage(i);
    for (const std::size_t skipped : skip_stages(chain_)) {
      tell_skip(skipped);
    }
    if (stopped_by_surroundings_) {
      end_at(one.stage);
    }
  }
  if (interrupted()) {  // in a stage that failed first
    end_by_signal();
  }
  export_results();
  refuse_nothing();
  chain_.account.seconds = seconds();
  try {
    if (const auto before = read_run_account(arguments_.places.workspace)) {
      keep_times(*before, chain_.account);
    }
  } catch (const DataError&) {  // which this run's own replaces
  }
}

double ChainRun::seconds() const {
  return seconds_since(begin_);
}

void ChainRun::end_report() {
  chain_.account.report_seconds = seconds_since(report_begin_);
}

void ChainRun::announce_report() {
  report_begin_ = Clock::now();
  const double seconds = expected_report_seconds(chain_);
  if (arguments_.json) {
    show_event({{"event", "report"}, {"expected_seconds", seconds}});
  } else {
    std::cout << "run: report, about " << duration_text(seconds) << std::endl;
  }
}

/// Ends the run at a stage whose failure would be that of the others as well: they are not begun.
void ChainRun::end_at(const std::string& stage) {
  for (std::size_t i = 0; i < chain_.account.stages.size(); ++i) {
    RunStageAccount& one = chain_.account.stages[i];
    if (one.end.empty()) {
      one.end = "skipped";
      one.why = "the run ended with the error of " + stage;
      tell_skip(i);
    }
  }
}

/// Exports the results of this run for other programs.
void ChainRun::export_results() {
  for (const StageRow* step : run_steps()) {
    const RunStageAccount* made = account_of(chain_, step->stage.name);
    if (step->chain->exported == nullptr || made == nullptr || !made->end.starts_with("done")) {
      continue;
    }
    RunStageAccount one;
    one.stage = "export";
    const Clock::time_point begin = Clock::now();
    try {
      const std::filesystem::path folder = step->chain->exported(arguments_.places.workspace);
      one.end = "done";
      one.seconds = seconds_since(begin);
      if (!arguments_.json) {
        std::cout << "run: export is done: " << printable(folder.string())
                  << "; atelier export writes everything" << std::endl;
      }
    } catch (const std::exception& error) {
      const Failure failure = failure_of(error);
      one.end = "failed";
      one.why = failure.text;
      exit_code_ = exit_code_ == kExitDone ? failure.exit_code : exit_code_;
      standard_error() << "atelier: export: " << printable(failure.text) << std::endl;
    }
    chain_.account.stages.push_back(one);
  }
}

/// Shows the work that would be done.
int ChainRun::plan() {
  for (std::size_t i = 0; i < chain_.account.stages.size(); ++i) {
    const RunStageAccount& one = chain_.account.stages[i];
    const bool to_run = one.end.empty();
    const std::string words = to_run                                     ? chain_.foreseen[i].words
                              : one.end == "skipped" && !arguments_.json ? "is skipped"
                                                                         : one.end;
    const std::vector<std::string> why = to_run ? chain_.foreseen[i].why : std::vector{one.why};
    if (arguments_.json) {
      show_event({{"event", "plan"},
                  {"stage", one.stage},
                  {"state", words},
                  {"reasons", why},
                  {"warnings", to_run ? chain_.foreseen[i].warnings : std::vector<std::string>()},
                  {"expected_seconds", one.expected}});
      continue;
    }
    std::string reasons;
    for (const std::string& reason : why) {
      reasons += (reasons.empty() ? ": " : "; ") + reason;
    }
    std::string name = one.stage;
    name.resize(std::max<std::size_t>(name.size(), 12), ' ');
    std::cout << "  " << name << " " << words << (why.front().empty() ? "" : printable(reasons))
              << "\n";
    for (const std::string& warning :
         to_run ? chain_.foreseen[i].warnings : std::vector<std::string>()) {
      std::cout << "    warning: " << printable(warning) << "\n";
    }
  }
  refuse_nothing();
  return std::any_of(chain_.foreseen.begin(), chain_.foreseen.end(),
                     [](const ForeseenStage& one) { return one.cannot; })
             ? kExitBadData
             : exit_code_;
}

/// A run that skipped all that it was asked for is no success.
void ChainRun::refuse_nothing() {
  const std::string why = why_all_skipped(chain_);
  if (exit_code_ != kExitDone || why.empty()) {
    return;
  }
  exit_code_ = kExitBadData;
  const RunStageAccount* judge = account_of(chain_, "validate");
  standard_error() << "atelier: " << printable(arguments_.places.capture.string())
                   << (judge != nullptr && judge->end != "not asked for"
                           ? ": every stage but validate is skipped: "
                           : ": every stage is skipped: ")
                   << why << std::endl;
}

void ChainRun::stage(std::size_t i) {
  RunStageAccount& one = chain_.account.stages[i];
  const Stage& row = run_steps()[i]->stage;
  StageConsole console(row, arguments_.json);
  StageEvents events;
  const Clock::time_point begin = Clock::now();
  events.progress = [&](const StageProgress& progress) {
    const bool known = progress.per_second > 0;
    console.set_rest(
        seconds_after(chain_, i, known ? seconds_since(begin) + progress.seconds_left : 0));
    console.show_progress(progress);
  };
  events.say = [&](const std::string& line) { console.say(line); };
  events.stop = interrupted;
  try {
    const StageRequest request = chain_request(chain_, i, true);
    // Without --from, what is outdated was recomputed before.
    const std::vector<std::string> outdated =
        arguments_.from.empty() ? std::vector<std::string>() : outdated_inputs(row, request);
    for (const std::string& sentence : outdated) {
      console.say("warning: " + sentence);
    }
    StageReport report = run_stage(all_stages(), row, request, events);
    report.plan.warnings.insert(report.plan.warnings.end(), outdated.begin(), outdated.end());
    one.seconds = seconds_since(begin);
    if (report.end == StageReport::End::Stopped) {
      console.show_report(report);
      std::cout.flush();
      end_by_signal();
    }
    one.end = report.end == StageReport::End::AlreadyDone ? "done already" : "done";
    show_end(console, report, one);
    if (report.input_errors) {
      one.why =
          "the capture has errors, or shows too little (see the warnings and its page in the "
          "report); what follows may be wrong";
      exit_code_ = kExitBadData;
    }
  } catch (const std::exception& error) {
    Failure failure = failure_of(error);
    failure.text =
        with_command(failure.text, row.name, chain_request(chain_, i, false).options.table);
    one.end = "failed";
    one.why = failure.text;
    one.seconds = seconds_since(begin);
    exit_code_ = exit_code_ == kExitDone ? failure.exit_code : exit_code_;
    console.show_error(failure);
    console.clear_line();
    stopped_by_surroundings_ =
        failure.exit_code == kExitEnvironment && failure.file != kAppearanceProgram;
    const std::filesystem::path folder = arguments_.places.workspace / one.stage;
    yields_ = stopped_by_surroundings_ && failure.file == folder.string() &&
              FileLock::is_held(folder / ".lock");
    standard_error() << "atelier: " << one.stage << ": " << printable(failure.text) << std::endl;
  }
}

/// A line for people, the event of the stage's own command for machines.
void ChainRun::show_end(StageConsole& console, const StageReport& report,
                        const RunStageAccount& one) {
  if (arguments_.json) {
    console.show_report(report);
    return;
  }
  console.clear_line();
  if (report.end == StageReport::End::Partial) {
    std::cout << "run: " << to_string(arguments_.selection) << " of " << one.stage << " is done, "
              << report.frames_done << " of " << counted(report.frames_total, "frame") << " in all"
              << std::endl;
    return;
  }
  std::cout << "run: " << one.stage << " is " << one.end;
  if (report.end == StageReport::End::Done) {
    std::cout << ", " << duration_text(one.seconds) << ", "
              << bytes_text(static_cast<double>(report.manifest.peak_memory_bytes)) << " of memory";
  }
  std::cout << std::endl;
  for (const std::string& warning : report.plan.warnings) {
    if (warnings_.insert(warning).second) {
      std::cout << "  warning: " << printable(warning) << std::endl;
    }
  }
}

}  // namespace atelier
