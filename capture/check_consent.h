#pragma once

#include <vector>

#include "capture/dataset.h"
#include "core/finding.h"

namespace atelier {

/// A warning ("consent-ended") for each consent to the capture whose last day (UTC) is over by now.
/// Every command that opens a capture tells it.
std::vector<Finding> check_ended_consent(const Dataset& dataset);

}  // namespace atelier
