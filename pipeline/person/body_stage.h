#pragma once

#include <array>

#include "bodymodel/underlying/underlying_sequence.h"
#include "core/store/stage.h"

namespace atelier {

struct BodyStageOptions {
  UnderlyingSequenceOptions fit;
  bool ground_truth_scans =
      false;  ///< surfaces of a synthetic capture's ground truth instead of the scans
};
OptionTable describe(BodyStageOptions& options);

struct RefineStageOptions {
  UnderlyingBodyOptions fit;
};
OptionTable describe(RefineStageOptions& options);

inline constexpr std::array kBodyMetrics = {
    StageMetric{"frames", ""},
    StageMetric{"untrusted", "frames"},
    StageMetric{"ground_truth_scans", ""},
    StageMetric{"outside_rate", "of what is covered"},
    StageMetric{"outside_depth", "m"},
    StageMetric{"proximity", "m"},
    StageMetric{"skin_distance", "m"},
    StageMetric{"seen_rate", "of the body"},
};

/// Scans, person and tracked poses -> a sequence of the body under the clothes: sequence.h5 and
/// frames/<frame>.h5 (core/sequence_archive.h), and certificates.json: for every frame how much of
/// what is covered lies outside, how deep, how near cloth is, and whether it is to be trusted; the
/// same as certificates.png, for users who have the files alone.
void run_body(StageRun& run);

/// The same once more, with the registered garment in place of the scans' clothing: a sequence of
/// meshes over one topology whose frames have the capture's numbers. Frames without one keep their
/// body. Throws DataError where no frame has one.
void run_refine(StageRun& run);

/// Throws DataError, with what to do, unless the garment is a folder or file of meshes.
void check_refine_input(const std::filesystem::path& input, const OptionTable& options);

/// Refuses a garment that is no sequence of meshes, or of none of the frames that the workspace's
/// `track` has. Throws DataError.
void require_garment(const std::filesystem::path& input, const std::filesystem::path& workspace);

}  // namespace atelier
