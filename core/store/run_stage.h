#pragma once

#include <cstdint>
#include <span>

#include "core/store/manifest.h"
#include "core/store/stage.h"
#include "core/store/stage_events.h"
#include "core/store/stage_plan.h"

namespace atelier {

/// Outcome of a run.
struct StageReport {
  enum class End {
    AlreadyDone,  ///< a sound result was there
    Done,         ///< the result is committed and current
    Partial,      ///< this run's frames are done; others are still to come
    Stopped,      ///< told to stop; finished frames are kept
  };

  End end = End::Done;
  StagePlan plan;                 ///< what there was to do, and why
  Manifest manifest;              ///< of the result, unless Partial or Stopped
  bool input_errors = false;      ///< Done or AlreadyDone: the stage found the INPUT to be no good
  bool again = false;             ///< Partial, while an older result of the request stays current
  std::int64_t frames_done = 0;   ///< of a frame-wise stage: all that are finished now
  std::int64_t frames_total = 0;  ///< 0 if it was stopped before a frame was begun
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
