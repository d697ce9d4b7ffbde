#include "apps/commands/chain_run.h"

#include <algorithm>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/console/failure.h"
#include "apps/console/interrupt.h"
#include "apps/console/option_flags.h"
#include "apps/console/standard_streams.h"
#include "core/device.h"
#include "core/error.h"
#include "core/io/json_text.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/quantity_text.h"
#include "core/store/digest_meter.h"
#include "core/store/file_lock.h"
#include "core/store/flag_command.h"
#include "core/store/output_place.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "core/store/utc_time.h"
#include "core/usage_error.h"
#include "pipeline/chain/outdated_results.h"
#include "pipeline/chain/run_options.h"
#include "pipeline/chain/time_left.h"
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

/// A stage's place in the chain. @param without  of no stage
std::size_t place_of(const std::string& stage, std::size_t without) {
  for (std::size_t i = 0; i < run_steps().size(); ++i) {
    if (run_steps()[i]->stage.name == stage) {
      return i;
    }
  }
  return without;
}

}  // namespace

void show_event(const nlohmann::json& json) {
  std::cout << json_text(json) << std::endl;
}

bool writes_report(const RunArguments& arguments) {
  return !arguments.without_report && arguments.selection.everything();
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
    : arguments_(arguments),
      options_(options),
      facts_(capture_facts(arguments.places.capture,
                           options_of<DatasetOptions>(options_of<RunOptions>(options).capture))) {
  for (const StageRow* step : run_steps()) {
    const auto suggested = step->chain->suggested;
    for (const SuggestedOption& one :
         suggested == nullptr ? std::vector<SuggestedOption>() : suggested(facts_)) {
      suggest(std::string(step->stage.name) + "." + std::string(one.name), std::string(one.value),
              std::string(one.why));
    }
  }
  const double machine = machine_pace();
  report_pace_ = machine;
  account_.capture = arguments.places.capture.string();
  account_.started = utc_text(static_cast<double>(std::time(nullptr)));
  for (const StageRow* step : run_steps()) {
    account_.stages.push_back(
        {std::string(step->stage.name), "", "", machine * expected_seconds(*step, facts_), 0});
  }
  learn_times();
  pass_over();
  for (const StageRow* step : run_steps()) {
    const ChainPlace& place = *step->chain;
    if (!arguments.material.empty() && !place.fabric_from.empty() &&
        goes_without(place.fabric_from)) {
      suggest(std::string(step->stage.name) + "." + std::string(place.fabric), arguments.material,
              "--material");
    }
  }
}

/// Whether no result of this run is of a kind: `fitted_material`, which tells which fabric was
/// asked for.
bool ChainRun::goes_without(std::string_view kind) const {
  const Stage* maker = stage_that_makes(all_stages(), kind);
  for (std::size_t i = 0; maker != nullptr && i < account_.stages.size(); ++i) {
    const RunStageAccount& one = account_.stages[i];
    if (one.stage == maker->name) {
      return one.end == "skipped" ||
             (!one.end.empty() && (!has_result(one.stage) || !option_changes(i).empty()));
    }
  }
  return maker == nullptr;
}

void ChainRun::announce() {
  if (!arguments_.json) {
    std::cout << "run: " << counted(facts_.cameras, "camera") << ", "
              << counted(facts_.frames, "frame") << ", " << facts_.masked_frames << " with masks, "
              << facts_.clothed_frames << " of them clothed" << std::endl;
  }
  foresee();
  double seconds = report_seconds();
  int stages = 0;
  int working = 0;
  for (const RunStageAccount& one : account_.stages) {
    if (one.end.empty()) {
      ++stages;
      working += works(one.stage) ? 1 : 0;
      seconds += works(one.stage) ? one.expected : 0;
    }
  }
  if (arguments_.json) {
    show_event({{"event", "run"}, {"stages", stages}, {"expected_seconds", seconds}});
    return;
  }
  const std::string time =
      "about " + duration_text(seconds) + " on " + counted(thread_count(), "core");
  const bool reports = writes_report(arguments_);
  if (working > 0) {
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
  for (const RunStageAccount& one : account_.stages) {
    if (one.end == "skipped" && !arguments_.dry_run) {  // whose plan lists them
      std::cout << "run: " << one.stage << " is skipped: " << one.why << std::endl;
    }
  }
}

/// Every stage in its order.
void ChainRun::work() {
  int place = 0;
  const auto asked = std::count_if(account_.stages.begin(), account_.stages.end(),
                                   [](const RunStageAccount& one) { return one.end.empty(); });
  for (std::size_t i = 0; i < account_.stages.size(); ++i) {
    RunStageAccount& one = account_.stages[i];
    if (!one.end.empty()) {
      continue;
    }
    ++place;
    if (!arguments_.json) {
      std::cout << "run: [" << place << " of " << asked << "] " << one.stage;
      if (works(one.stage)) {
        const double seconds = pace(i, 0) * one.expected;
        std::cout << ", about " << duration_text(seconds) << "; about "
                  << duration_text(seconds + rest_after(i, 0)) << " left in all";
      }
      std::cout << std::endl;
    }
    stage(i);
    pass_over();
    if (stopped_by_surroundings_) {
      end_at(one.stage);
    }
  }
  if (interrupted()) {  // in a stage that failed first
    end_by_signal();
  }
  export_results();
  refuse_nothing();
  account_.seconds = seconds();
  try {
    if (const auto before = read_run_account(arguments_.places.workspace)) {
      keep_times(*before, account_);
    }
  } catch (const DataError&) {  // which this run's own replaces
  }
}

/// Takes the times of the workspace's last run of the same capture for what stages take.
void ChainRun::learn_times() {
  try {
    const auto before = read_run_account(arguments_.places.workspace);
    std::error_code ignored;
    if (!before || !std::filesystem::equivalent(before->capture, account_.capture, ignored)) {
      return;
    }
    for (const RunStageAccount& earlier : before->stages) {
      for (RunStageAccount& one : account_.stages) {
        if (one.stage == earlier.stage && earlier.seconds > 0 && earlier.end.starts_with("done")) {
          one.expected = earlier.seconds;
        }
      }
    }
    if (before->report_seconds > 0) {
      std::vector<std::string> shown;
      for (const RunStageAccount& earlier : before->stages) {
        if (earlier.end.starts_with("done")) {
          shown.push_back(earlier.stage);
        }
      }
      report_pace_ = before->report_seconds / expected_report_seconds(facts_, shown);
    }
  } catch (const DataError&) {  // the report says it
  }
}

/// Expected of the report on the results that are there at the end, if this run writes it. Stages
/// that take longer than expected say nothing of it.
double ChainRun::report_seconds() const {
  if (!writes_report(arguments_)) {
    return 0;
  }
  std::vector<std::string> shown;
  for (const RunStageAccount& one : account_.stages) {
    const bool to_come = one.end.empty() && works(one.stage);
    if (to_come || has_result(one.stage)) {
      shown.push_back(one.stage);
    }
  }
  return report_pace_ * expected_report_seconds(facts_, shown);
}

double ChainRun::seconds() const {
  return seconds_since(begin_);
}

void ChainRun::end_report() {
  account_.report_seconds = seconds_since(report_begin_);
}

void ChainRun::announce_report() {
  report_begin_ = Clock::now();
  const double seconds = report_seconds();
  if (arguments_.json) {
    show_event({{"event", "report"}, {"expected_seconds", seconds}});
  } else {
    std::cout << "run: report, about " << duration_text(seconds) << std::endl;
  }
}

/// Ends the run at a stage whose failure would be that of the others as well: they are not begun.
void ChainRun::end_at(const std::string& stage) {
  for (RunStageAccount& one : account_.stages) {
    if (one.end.empty()) {
      one.end = "skipped";
      one.why = "the run ended with the error of " + stage;
      if (arguments_.json) {
        show_event({{"event", "skip"}, {"stage", one.stage}, {"why", one.why}});
      }
    }
  }
}

/// Exports the results of this run for other programs.
void ChainRun::export_results() {
  for (const StageRow* step : run_steps()) {
    const RunStageAccount* made = account_of(step->stage.name);
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
    account_.stages.push_back(one);
  }
}

/// Shows the work that would be done.
int ChainRun::plan() {
  for (std::size_t i = 0; i < account_.stages.size(); ++i) {
    const RunStageAccount& one = account_.stages[i];
    const bool to_run = one.end.empty();
    const std::string words = to_run                                     ? foreseen_[i].words
                              : one.end == "skipped" && !arguments_.json ? "is skipped"
                                                                         : one.end;
    const std::vector<std::string> why = to_run ? foreseen_[i].why : std::vector{one.why};
    if (arguments_.json) {
      show_event({{"event", "plan"},
                  {"stage", one.stage},
                  {"state", words},
                  {"reasons", why},
                  {"warnings", to_run ? foreseen_[i].warnings : std::vector<std::string>()},
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
    for (const std::string& warning : to_run ? foreseen_[i].warnings : std::vector<std::string>()) {
      std::cout << "    warning: " << printable(warning) << "\n";
    }
  }
  refuse_nothing();
  return std::any_of(foreseen_.begin(), foreseen_.end(),
                     [](const Foreseen& one) { return one.cannot; })
             ? kExitBadData
             : exit_code_;
}

/// Why every stage that was asked for is skipped, but the one that judges any capture; "" if one is
/// not.
std::string ChainRun::why_nothing() const {
  constexpr std::string_view kJudge = "validate";
  std::string why;
  for (const RunStageAccount& one : account_.stages) {
    if (one.end == "not asked for" || one.stage == kJudge) {
      continue;
    }
    if (one.end != "skipped") {
      return "";
    }
    why = why.empty() ? one.why : why;
  }
  return why;
}

/// A run that skipped all that it was asked for is no success.
void ChainRun::refuse_nothing() {
  const std::string why = why_nothing();
  if (exit_code_ != kExitDone || why.empty()) {
    return;
  }
  exit_code_ = kExitBadData;
  standard_error() << "atelier: " << printable(arguments_.places.capture.string())
                   << ": every stage is skipped: " << why << std::endl;
}

/// Sets an option that nobody set, of a stage that the program has.
void ChainRun::suggest(const std::string& name, const std::string& value, const std::string& why) {
  for (const OptionField& field : options_.table.fields) {
    if (field.name == name && field.source == "default") {
      const std::string problem = set_option(options_.table, name, value, why);
      ATELIER_CHECK(problem.empty(), problem);
      return;
    }
  }
}

bool ChainRun::has_result(const std::string& stage) const {
  const std::vector<std::string>& aside = arguments_.set_aside;
  return (!arguments_.dry_run || std::find(aside.begin(), aside.end(), stage) == aside.end()) &&
         current_name(arguments_.places.workspace / stage).has_value();
}

/// Whether a stage of this run is foreseen to take its time.
bool ChainRun::works(std::string_view stage) const {
  for (std::size_t i = 0; i < foreseen_.size(); ++i) {
    if (account_.stages[i].stage == stage) {
      return foreseen_[i].works;
    }
  }
  return false;
}

void ChainRun::require_feasible() const {
  if (const std::string why = why_nothing(); !why.empty()) {
    throw DataError(arguments_.places.capture.string(), "", "every stage is skipped: " + why,
                    "a capture that some stage can read");
  }
  for (std::size_t i = 0; i < account_.stages.size(); ++i) {
    if (!account_.stages[i].end.empty()) {
      continue;
    }
    for (const std::string_view needed : needed_stages(*run_steps()[i], facts_)) {
      const RunStageAccount* maker = account_of(needed);
      const bool made = maker != nullptr && maker->end.empty();
      if (!made && !has_result(std::string(needed))) {
        throw DataError((arguments_.places.workspace / needed).string(), "",
                        "no result of this capture, which " + account_.stages[i].stage + " reads",
                        "a run that makes it: begin --from " + std::string(needed));
      }
    }
    StageRequest request = request_of(i, false);
    request.workspace.clear();  // of whose results some are another capture's
    require_startable(run_steps()[i]->stage, request);
  }
}

/// Finds the work to do for every stage that is to run. Errors in data are told by the stage when
/// its turn comes, of a dry run now.
void ChainRun::foresee() {
  bool anew = false;  // something that the next stage may read
  for (std::size_t i = 0; i < account_.stages.size(); ++i) {
    Foreseen one;
    if (account_.stages[i].end.empty()) {
      try {
        one = foreseen(i);
      } catch (const StopRequested&) {
        end_by_signal();
      } catch (const std::exception&) {
        if (arguments_.dry_run) {
          throw;
        }
        one.works = true;
      }
    }
    if (one.works) {  // told now rather than behind hours of other stages
      StageRequest request = request_of(i, false);
      if (anew) {
        request.workspace.clear();
      }
      require_startable(run_steps()[i]->stage, request);
      one.warnings = previewed_warnings(run_steps()[i]->stage, request);
      anew = true;
    }
    foreseen_.push_back(std::move(one));
  }
}

const RunStageAccount* ChainRun::account_of(std::string_view stage) const {
  const auto found = std::find_if(account_.stages.begin(), account_.stages.end(),
                                  [&](const RunStageAccount& one) { return one.stage == stage; });
  return found == account_.stages.end() ? nullptr : &*found;
}

/// Stages that nobody asked for, that this program does not have, for which the capture has
/// nothing, and those that would read their results.
void ChainRun::pass_over() {
  const auto begin = place_of(arguments_.from, 0);
  const auto end = place_of(arguments_.to, run_steps().size() - 1);
  for (std::size_t i = 0; i < account_.stages.size(); ++i) {
    RunStageAccount& one = account_.stages[i];
    const StageRow& step = *run_steps()[i];
    if (!one.end.empty()) {
      continue;
    }
    if (i < begin || i > end) {
      one.end = "not asked for";
      continue;
    }
    one.why = nothing_for(step, facts_);
    for (const std::string_view needed : needed_stages(step, facts_)) {
      const RunStageAccount* other = account_of(needed);
      if (one.why.empty() && find_row(needed) == nullptr) {
        one.why =
            "it reads the result of " + std::string(needed) + ", which this build does not have";
      }
      if (one.why.empty() && other != nullptr &&
          (other->end == "skipped" || other->end == "failed")) {
        one.why = "it reads the result of " + other->stage + ", which " +
                  (other->end == "failed" ? "failed" : "is skipped");
      }
    }
    one.end = one.why.empty() ? "" : "skipped";
    if (arguments_.json && !one.end.empty()) {
      show_event({{"event", "skip"}, {"stage", one.stage}, {"why", one.why}});
    }
  }
}

/// How many times longer than expected stages take: those that have ended, and the one that is at
/// work, of which it is known that it takes so many seconds in all. @param seconds  0: not known
double ChainRun::pace(std::size_t now, double seconds) const {
  std::vector<StageTime> times;
  for (std::size_t i = 0; i < account_.stages.size(); ++i) {
    const RunStageAccount& one = account_.stages[i];
    if (one.end == "done" && works(one.stage)) {
      times.push_back({one.expected, one.seconds});
    } else if (i == now) {
      times.push_back({one.expected, seconds});
    }
  }
  return run_pace(times);
}

/// s that remain behind the stage at work. @param seconds  that it takes in all; 0: not known
double ChainRun::rest_after(std::size_t i, double seconds) const {
  double rest = 0;
  for (std::size_t k = i + 1; k < account_.stages.size(); ++k) {
    const RunStageAccount& one = account_.stages[k];
    rest += one.end.empty() && works(one.stage) ? one.expected : 0;
  }
  return pace(i, seconds) * rest + report_seconds();
}

StageRequest ChainRun::request_of(std::size_t i, bool make_input) const {
  const StageRow& step = *run_steps()[i];
  const Stage& row = step.stage;
  StageRequest request;
  request.workspace = arguments_.places.workspace;
  const auto input = step.chain->input;
  request.input =
      input != nullptr && make_input ? input(arguments_.places) : arguments_.places.capture;
  request.options = stage_options(options_, std::string(row.name));
  request.selection = arguments_.selection;
  request.jobs = arguments_.jobs;
  request.device = arguments_.device == "cuda" && row.has_cuda ? Device::Cuda : Device::Cpu;
  return request;
}

void ChainRun::stage(std::size_t i) {
  RunStageAccount& one = account_.stages[i];
  const Stage& row = run_steps()[i]->stage;
  StageConsole console(row, arguments_.json);
  StageEvents events;
  const Clock::time_point begin = Clock::now();
  events.progress = [&](const StageProgress& progress) {
    const bool known = progress.per_second > 0;
    console.set_rest(rest_after(i, known ? seconds_since(begin) + progress.seconds_left : 0));
    console.show_progress(progress);
  };
  events.say = [&](const std::string& line) { console.say(line); };
  events.stop = interrupted;
  try {
    const StageRequest request = request_of(i, true);
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
    failure.text = with_command(failure.text, row.name, request_of(i, false).options.table);
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

/// Differences in options and device from those that a stage's current result was made with, or
/// that it is damaged. For a stage whose INPUT is made of results, of which no plan can be made
/// before.
std::vector<std::string> ChainRun::option_changes(std::size_t i) const {
  const Stage& row = run_steps()[i]->stage;
  const StageRequest request = request_of(i, false);
  const std::filesystem::path folder = request.workspace / row.name;
  Manifest before;
  try {
    before = read_manifest(folder / *current_name(folder), row.name);
  } catch (const NewerManifestError&) {
    throw;
  } catch (const DataError&) {
    return {"the current result is damaged"};
  }
  Manifest now = before;
  now.stage_version = row.version;
  now.device = row.device_keyed ? device_name(request.device) : "";
  now.options.clear();
  for (const OptionField& field : request.options.table.fields) {
    now.options.push_back({field.name, option_json(field), field.source, field.keyed});
  }
  now.canonical_options = canonical_json(request.options.table);
  const bool same = now.stage_version == before.stage_version && now.device == before.device &&
                    now.canonical_options == before.canonical_options;
  return same ? std::vector<std::string>{} : request_changes(before, now);
}

/// Of a stage that needs a result which is not there, or is recomputed.
ChainRun::Foreseen ChainRun::unplanned(std::string_view needed) const {
  for (std::size_t k = 0; k < foreseen_.size(); ++k) {
    const RunStageAccount& maker = account_.stages[k];
    if (maker.stage != needed) {
      continue;
    }
    if (foreseen_[k].cannot) {
      return {"cannot run",
              {"it reads the result of " + maker.stage + ", which cannot run"},
              false,
              true};
    }
    if (maker.end == "not asked for") {
      return {"cannot run",
              {"no result of " + maker.stage + ", which --from " + arguments_.from + " leaves out"},
              false,
              true};
    }
  }
  return {"would run", {"after " + std::string(needed)}, true};
}

/// Of a stage whose predecessors are foreseen.
ChainRun::Foreseen ChainRun::foreseen(std::size_t i) const {
  const StageRow& step = *run_steps()[i];
  bool earlier = false;
  const std::vector<std::string_view> all_needed = needed_stages(step, facts_);
  for (const std::string_view needed : all_needed) {
    if (!has_result(std::string(needed))) {
      return unplanned(needed);
    }
    earlier = earlier || works(needed);
  }
  const std::vector<std::string_view> all_read = optional_stages(step);
  for (const std::string_view read : all_read) {
    if (works(read) && !has_result(std::string(read))) {
      return {"would run", {"after " + std::string(read)}, true};
    }
    earlier = earlier || works(read);
  }
  if (step.chain->input != nullptr) {
    const std::string made = "its input is made of earlier results";
    if (!has_result(std::string(step.stage.name)) || earlier) {
      return {"would run", {made}, true};
    }
    const std::vector<std::string> changes = option_changes(i);
    return changes.empty() ? Foreseen{"would check its result", {made}, false}
                           : Foreseen{"would run", changes, true};
  }
  try {
    return planned(i, earlier);
  } catch (const NewerManifestError&) {
    throw;
  } catch (const DataError& error) {
    for (const auto& makers : {all_needed, all_read}) {
      for (const std::string_view maker : makers) {  // damaged, and recomputed before this one
        if (works(maker) && is_inside(error.file, arguments_.places.workspace / maker)) {
          return unplanned(maker);
        }
      }
    }
    throw;
  }
}

/// Of a stage that finds its inputs.
ChainRun::Foreseen ChainRun::planned(std::size_t i, bool earlier) const {
  const Stage& row = run_steps()[i]->stage;
  StageConsole console(row, false);
  StageEvents events;
  if (!arguments_.json) {  // whose first event is "run"
    events.progress = [&](const StageProgress& progress) { console.show_progress(progress); };
  }
  events.stop = interrupted;
  const StagePlan plan = plan_stage(all_stages(), row, request_of(i, false), events);
  if (plan.state == StagePlan::State::Done) {
    return {
        "would do nothing", {earlier ? "unless an earlier stage's result changes" : ""}, earlier};
  }
  return {plan.state == StagePlan::State::Resume ? "would go on" : "would run", plan.reasons, true};
}

}  // namespace atelier
