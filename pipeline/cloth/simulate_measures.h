#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// Whether the simulated garments stayed where the capture has them: how far what holds them is
/// from where the body carries it, the mean distance from where they were registered, and the
/// strain, from the metrics of the stage's result. Needs no ground truth. Throws DataError.
std::vector<Measure> measure_simulate(const std::filesystem::path& workspace,
                                      const std::filesystem::path& capture);

}  // namespace atelier
