#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// Why a result of `track` cannot be measured; "" if it can, or is not there. The bodies of a
/// sequence may have no joints that match a person.
std::string track_problem(const std::filesystem::path& workspace,
                          const std::filesystem::path& capture);

/// Why a result of `personalize` cannot be measured; "" if it can, or is not there. A body model
/// other than the ground truth's rests in another pose, and a sequence's body nowhere.
std::string personalize_problem(const std::filesystem::path& workspace,
                                const std::filesystem::path& capture);

/// personal.* of a workspace's result of `personalize` against a synthetic capture's ground truth;
/// none where there is no result.
std::vector<Measure> measure_personalize(const std::filesystem::path& workspace,
                                         const std::filesystem::path& capture);

/// track.* of its result of `track`. Where the true clothing swings, whatever the result left out,
/// the clothed sequence is tracked again with exclude = none and auto, and with the ground-truth
/// garments of `--input.excluded` left out, all else as it was.
std::vector<Measure> measure_track(const std::filesystem::path& workspace,
                                   const std::filesystem::path& capture);

}  // namespace atelier
