#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>

#include "apps/console/stage_console.h"
#include "core/exit_code.h"
#include "core/options.h"
#include "core/store/run_stage.h"
#include "pipeline/chain/chain.h"

namespace atelier {

/// Arguments of `atelier run` beside the options of the stages.
struct RunArguments : ChainRequest {
  int threads = 0;       ///< 0: one for each processor core
  std::string workflow;  ///< who does it as jobs: "local", a profile of Snakemake; "": this process
  bool replace = false;
  bool json = false;
};

/// One fabric for every stage that takes one; none is then searched for. Throws UsageError.
/// @param options  as `run_options` makes them
void set_material(OptionSet& options, const std::string& fabric);

/// One run of the chain, and its account. Exceptions of a stage are printed and kept in the
/// account: the stages that do not read its result go on, unless it was the surroundings that
/// failed.
class ChainRun {
 public:
  /// As `begin_chain`.
  ChainRun(const RunArguments& arguments, const OptionSet& options);

  /// Prints what exists, what will be done, and the expected time; before `plan` without the stages
  /// that are skipped, which that lists.
  void announce();
  /// Every stage in its order.
  void work();
  /// Says that the report is being made, and how long it takes.
  void announce_report();
  /// Says what `work` would do. After `announce`. Returns the exit code of a run that could not.
  int plan();

  const Chain& chain() const { return chain_; }
  const RunAccount& account() const { return chain_.account; }
  /// s since this run began
  double seconds() const;
  /// Keeps in the account how long the report took.
  void end_report();
  const CaptureFacts& facts() const { return chain_.facts; }
  /// Of the first failure.
  int exit_code() const { return exit_code_; }
  /// Whether it ended because another run works on one of its stages.
  bool yields() const { return yields_; }

 private:
  using Clock = std::chrono::steady_clock;

  void tell_skip(std::size_t i) const;
  void foresee();
  void stage(std::size_t i);
  void end_at(const std::string& stage);
  void export_results();
  void show_end(StageConsole& console, const StageReport& report, const RunStageAccount& one);
  void refuse_nothing();

  Clock::time_point begin_ = Clock::now();
  RunArguments arguments_;
  Chain chain_;
  Clock::time_point report_begin_{};
  std::set<std::string> warnings_;
  int exit_code_ = kExitDone;
  bool stopped_by_surroundings_ = false;
  bool yields_ = false;
};

/// One line of JSON on standard output, for machines.
void show_event(const nlohmann::json& json);

}  // namespace atelier
