#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/store/manifest.h"
#include "core/store/stage.h"
#include "core/store/stage_plan.h"

namespace atelier {

/// How far a run is.
struct StageProgress {
  std::string unit = "frames";
  std::int64_t done = 0;  ///< of `total`, those of earlier runs included
  std::int64_t total = 0;
  double per_second = 0;    ///< rate of this run; 0 while it is not known
  double seconds_left = 0;  ///< at that rate
};

/// Whom a run tells. Each may be empty. They are called from one thread at a time.
struct StageEvents {
  std::function<void(const StageProgress&)> progress;
  std::function<void(const std::string& line)> say;
  std::function<bool()> stop;  ///< asked between frames: true ends the run early and cleanly
};

/// What a run came to.
struct StageReport {
  enum class End {
    AlreadyDone,  ///< a sound result was there
    Done,         ///< the result is committed and current
    Partial,      ///< this run's frames are done; others are still to come
    Stopped,      ///< told to stop; finished frames are kept
  };

  End end = End::Done;
  StagePlan plan;                ///< what there was to do, and why
  Manifest manifest;             ///< of the result, unless Partial or Stopped
  std::int64_t frames_done = 0;  ///< of a frame-wise stage: all that are finished now
  std::int64_t frames_total = 0;
};

/// Does what is to be done so that the stage's result for this request is there and current:
/// nothing if it is; the missing frames of an interrupted or split run; else everything. A result
/// appears whole, by one rename after fsync, or not at all, and replaces an older one of the same
/// key only then; results of other keys stay for `collect_garbage`.
///
/// Throws EnvironmentError if another run has the stage (or one of the frames), if the disk is full
/// or fails; DataError as `plan_stage` does, and if an input changed meanwhile. Finished frames
/// outlive every failure.
StageReport run_stage(std::span<const Stage> stages, const Stage& stage,
                      const StageRequest& request, const StageEvents& events = {});

}  // namespace atelier
