#pragma once

#ifdef ATELIER_HAS_CAPTURE

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/capture_facts.h"
#include "apps/exit_code.h"
#include "apps/run_account.h"
#include "apps/run_chain.h"
#include "apps/stage_console.h"
#include "core/options.h"
#include "core/store/stage_plan.h"

namespace atelier {

/// What `atelier run` is told beside the options of the stages.
struct RunArguments {
  RunPlaces places;
  std::string from;
  std::string to;
  int jobs = 0;
  std::string device = "cpu";
  std::string material;
  bool dry_run = false;
  bool json = false;
};

/// One run of the chain, and its account. What a stage throws is told and kept in the account: the
/// stages that do not read its result go on.
class ChainRun {
 public:
  /// @param options  as `run_options` makes them; what this capture asks for is set where nobody
  ///                 set anything else. Throws as `capture_facts`.
  ChainRun(const RunArguments& arguments, const OptionSet& options);

  /// What there is, what will be done, and how long it takes.
  void announce() const;
  /// Every stage in its order.
  void work();
  /// Says what `work` would do.
  void plan();

  const RunAccount& account() const { return account_; }
  const CaptureFacts& facts() const { return facts_; }
  /// Of the first failure.
  int exit_code() const { return exit_code_; }

 private:
  using Clock = std::chrono::steady_clock;

  void suggest(const std::string& name, const std::string& value, const std::string& why);
  bool has_result(const std::string& stage) const;
  const RunStageAccount* account_of(std::string_view stage) const;
  void pass_over();
  double factor() const;
  double rest_after(std::size_t i) const;
  StageRequest request_of(std::size_t i, bool make_input) const;
  void stage(std::size_t i);
  void export_avatar();
  void show_end(StageConsole& console, const StageReport& report, const RunStageAccount& one);
  std::pair<std::string, std::vector<std::string>> planned(
      std::size_t i, const std::set<std::string_view>& working) const;

  RunArguments arguments_;
  OptionSet options_;
  CaptureFacts facts_;
  RunAccount account_;
  std::set<std::string> warnings_;
  int exit_code_ = kExitDone;
  Clock::time_point begin_ = Clock::now();
};

/// One line of JSON on standard output, for machines.
void show_event(const nlohmann::json& json);

}  // namespace atelier

#endif
