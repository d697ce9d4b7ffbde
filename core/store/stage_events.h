#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace atelier {

/// How far a run is.
struct StageProgress {
  std::string unit = "frames";  ///< of `done` and `total`; "bytes digested" before the work
  std::int64_t done = 0;        ///< of `total`, those of earlier runs included
  std::int64_t total = 0;
  double per_second = 0;    ///< rate of this run; 0 while it is not known
  double seconds_left = 0;  ///< at that rate
  std::vector<std::pair<std::string, double>> figures{};  ///< how it goes: a training's loss
};

/// Whom a run tells. Each may be empty. They are called from one thread at a time.
struct StageEvents {
  std::function<void(const StageProgress&)> progress;
  std::function<void(const std::string& line)> say;
  /// Asked between frames, and between the chunks of files that are digested: true ends the run
  /// early and cleanly.
  std::function<bool()> stop;
};

}  // namespace atelier
