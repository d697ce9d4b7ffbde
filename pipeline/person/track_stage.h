#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "bodymodel/tracking/track.h"
#include "core/store/stage.h"
#include "pipeline/person/person_input.h"

namespace atelier {

struct TrackStageOptions {
  PersonInputOptions input;
  TrackOptions fit;
  std::string region;   ///< vertex group of the body, or JSON file with a list of vertices, over
                        ///< which exclude = region leaves clothing out
  bool compare = true;  ///< track once more with nothing left out, for the report
};
OptionTable describe(TrackStageOptions& options);

inline constexpr std::array kTrackMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"trusted_share", "of the frames"},
    StageMetric{"keypoint_rms", "m"},
    StageMetric{"scan_rms", "m"},
    StageMetric{"deviation_mean", "m"},
    StageMetric{"region_share", "of the body's vertices"},
    StageMetric{"keypoint_rms_none", "m, with nothing left out"},
    StageMetric{"scan_rms_none", "m, with nothing left out"},
    StageMetric{"legs_moved_none", "m, from where nothing is left out"},
};

/// Refuses a person that the keypoints of the workspace, where there are any, do not show, and a
/// region that its person does not have; "": of none. Throws DataError.
void require_trackable(const TrackStageOptions& options, const std::filesystem::path& workspace);

/// Keypoints, scans and the person -> tracked/<sequence>.h5 (bodymodel/formats/tracked_motion.h)
/// and motion/<sequence>.npz (a motion that reads as any other), one of each for every sequence,
/// and for the report pictures/<sequence>_frames.png (every frame's errors) and
/// pictures/<sequence>_region.png (over what clothing was left out). Where clothing was left out,
/// metrics also say what the same tracking gives without that: its errors, and how far its legs are
/// from these.
void run_track(StageRun& run);

}  // namespace atelier
