#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "apps/console/stage_console.h"
#include "capture/layouts/capture_facts.h"
#include "core/exit_code.h"
#include "core/options.h"
#include "core/store/frame_selection.h"
#include "core/store/stage_plan.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/pictures/run_account.h"

namespace atelier {

/// Arguments of `atelier run` beside the options of the stages.
struct RunArguments {
  RunPlaces places;
  std::string from;
  std::string to;
  int jobs = 0;
  int threads = 0;  ///< 0: one for each processor core
  std::string device = "cpu";
  std::string material;
  FrameSelection selection;  ///< of the one stage that it does
  bool without_report = false;
  std::string workflow;  ///< who does it as jobs: "local", a profile of Snakemake; "": this process
  bool replace = false;
  std::vector<std::string> set_aside;  ///< stages whose results count as not there
  bool dry_run = false;
  bool json = false;
};

/// Whether the run ends with a report: on whole stages, unless it is not asked for.
bool writes_report(const RunArguments& arguments);

/// One fabric for every stage that takes one; none is then searched for. Throws UsageError.
/// @param options  as `run_options` makes them
void set_material(OptionSet& options, const std::string& fabric);

/// One run of the chain, and its account. Exceptions of a stage are printed and kept in the
/// account: the stages that do not read its result go on, unless it was the surroundings that
/// failed.
class ChainRun {
 public:
  /// @param options  as `run_options` makes them; what this capture asks for is set where nobody
  ///                 set anything else. Throws as `capture_facts`.
  ChainRun(const RunArguments& arguments, const OptionSet& options);

  /// Refuses, before anything is done, what could not come to an end: a capture for which every
  /// stage is skipped, a stage that lacks a result which this run does not make, what options name
  /// and is not there. Throws DataError, EnvironmentError.
  void require_feasible() const;
  /// Prints what exists, what will be done, and the expected time; before `plan` without the stages
  /// that are skipped, which that lists.
  void announce();
  /// Every stage in its order.
  void work();
  /// Says that the report is being made, and how long it takes.
  void announce_report();
  /// Says what `work` would do. After `announce`. Returns the exit code of a run that could not.
  int plan();

  const RunAccount& account() const { return account_; }
  /// s since this run began
  double seconds() const;
  /// Keeps in the account how long the report took.
  void end_report();
  const CaptureFacts& facts() const { return facts_; }
  /// Of the first failure.
  int exit_code() const { return exit_code_; }
  /// Whether it ended because another run works on one of its stages.
  bool yields() const { return yields_; }

 private:
  using Clock = std::chrono::steady_clock;

  /// The work that remains for one stage, as far as that can be told before the stages in front of
  /// it have run.
  struct Foreseen {
    std::string words;  ///< "would run"
    std::vector<std::string> why;
    bool works = false;   ///< takes its time: unlikely to find its result as it is
    bool cannot = false;  ///< lacks what this run does not make
    std::vector<std::string> warnings = {};  ///< of what its options name
  };

  void suggest(const std::string& name, const std::string& value, const std::string& why);
  bool has_result(const std::string& stage) const;
  std::string why_nothing() const;
  void refuse_nothing();
  bool works(std::string_view stage) const;
  Foreseen unplanned(std::string_view needed) const;
  Foreseen planned(std::size_t i, bool earlier) const;
  const RunStageAccount* account_of(std::string_view stage) const;
  bool goes_without(std::string_view kind) const;
  void foresee();
  void pass_over();
  double pace(std::size_t now, double seconds) const;
  double rest_after(std::size_t i, double seconds) const;
  void learn_times();
  double report_seconds() const;
  StageRequest request_of(std::size_t i, bool make_input) const;
  void stage(std::size_t i);
  void end_at(const std::string& stage);
  void export_results();
  void show_end(StageConsole& console, const StageReport& report, const RunStageAccount& one);
  std::vector<std::string> option_changes(std::size_t i) const;
  Foreseen foreseen(std::size_t i) const;

  RunArguments arguments_;
  OptionSet options_;
  CaptureFacts facts_;
  double report_pace_ = 1;  ///< times that a report takes longer than its parts are expected to
  Clock::time_point report_begin_{};
  RunAccount account_;
  std::vector<Foreseen> foreseen_;  ///< of each stage of the account; of those that are to run
  std::set<std::string> warnings_;
  int exit_code_ = kExitDone;
  bool stopped_by_surroundings_ = false;
  bool yields_ = false;
  Clock::time_point begin_ = Clock::now();
};

/// One line of JSON on standard output, for machines.
void show_event(const nlohmann::json& json);

}  // namespace atelier
