#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "apps/console/failure.h"
#include "core/store/run_stage.h"

namespace atelier {

/// Shows a run: one line that renews itself on a terminal, plain lines now and then elsewhere,
/// lines of JSON on standard output for machines.
class StageConsole {
 public:
  /// @param stage  outlives it
  StageConsole(const Stage& stage, bool json);
  ~StageConsole();
  StageConsole(const StageConsole&) = delete;
  StageConsole& operator=(const StageConsole&) = delete;

  /// Seconds that stages after this one are expected to take: progress then also says how long all
  /// is going to take.
  void set_rest(double seconds) { rest_ = seconds; }
  /// The run is one with --force, which starts over each time: what goes on after a stop is another
  /// command.
  void set_forced(bool forced) { forced_ = forced; }
  void say(const std::string& line);
  void show_progress(const StageProgress& progress);
  /// @param selection  of frames, which alone would be worked on
  void show_plan(const StagePlan& plan, const FrameSelection& selection);
  void show_report(const StageReport& report);
  /// The event "error", for machines; people read it on standard error.
  void show_error(const Failure& failure);
  /// Takes away the line that renews itself, before others write.
  void clear_line();

 private:
  std::string goes_on(const StageReport& report) const;

  const Stage& stage_;
  bool json_;
  bool terminal_;
  bool line_shown_ = false;
  bool forced_ = false;
  double rest_ = -1;                ///< s; below 0: not known
  std::int64_t first_frames_ = -1;  ///< done when they were first told of
  std::chrono::steady_clock::time_point last_shown_{};
};

/// The event "error" on standard output. @param kind  of what failed: "stage" or "command"
void show_error_event(const char* kind, std::string_view name, const Failure& failure);

}  // namespace atelier
