#pragma once

#include <filesystem>
#include <string>

#include "core/archive.h"
#include "core/ground_truth.h"
#include "core/limits.h"
#include "core/plain_name.h"

namespace atelier {

/// truth/truth.h5 (schema "atelier.truth", version 1) and truth/frames/000012.h5 (schema
/// "atelier.truth.frame", version 1) of docs/reference/formats.md, and back. Reading throws
/// DataError for arrays that are missing, of another shape, or out of range.
Archive archive_of(const GroundTruth& truth);
GroundTruth truth_of(const Archive& archive, const std::string& file = "");
Archive archive_of(const GroundTruthFrame& frame, const GroundTruth& truth);
GroundTruthFrame ground_truth_frame_of(const Archive& archive, const GroundTruth& truth,
                                       const std::string& file = "");

GroundTruth read_ground_truth(const std::filesystem::path& capture, const Limits& limits = {});
GroundTruthFrame read_ground_truth_frame(const std::filesystem::path& capture,
                                         const GroundTruth& truth, int frame_id,
                                         const Limits& limits = {});

}  // namespace atelier
