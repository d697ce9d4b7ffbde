#pragma once

#include <vector>

#include "capture/dataset.h"

namespace atelier {

/// Findings whose settings are typed beside the corrections that a data set was opened with
/// (Dataset::corrections): what is advised joins what is set, an advice that undoes what is set
/// says to take it away, and none repeats it. Settings of other options are left as they are.
std::vector<Finding> settle_advice(std::vector<Finding> findings, const Dataset& dataset);

}  // namespace atelier
