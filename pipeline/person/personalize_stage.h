#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "bodymodel/tracking/personalize.h"
#include "core/store/stage.h"
#include "pipeline/person/person_input.h"

namespace atelier {

struct PersonalizeStageOptions {
  PersonInputOptions input;
  std::string body = "default";  ///< a file that read_body_file knows, "default", "female", "male"
  PersonalizeOptions fit;
  std::string sequence;  ///< name of the sequence to measure on; "": the first minimally clothed
                         ///< one, or the first
  int max_frames = 12;   ///< of a sequence that are fitted, spread evenly, [1, 1000]
};
OptionTable describe(PersonalizeStageOptions& options);

inline constexpr std::array kPersonalizeMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"minimal", ""},
    StageMetric{"scan_rms", "m"},
    StageMetric{"keypoint_rms", "m"},
    StageMetric{"displacement_rms", "m"},
    StageMetric{"unseen_share", "of the surface"},
};

/// Refuses a sequence that the capture does not have, a body that is none, and a person that the
/// keypoints of the workspace, where there are any, do not show; "": of none. Throws DataError.
void require_measurable(const PersonalizeStageOptions& options,
                        const std::filesystem::path& capture,
                        const std::filesystem::path& workspace);

/// Keypoints and scans -> person.npz (a body that reads as any other) and shape.json (the values
/// found, with names). From the minimally clothed sequence; without
/// one, or where another is asked for, from skin and keypoints of a clothed one, which it says.
void run_personalize(StageRun& run);

}  // namespace atelier
