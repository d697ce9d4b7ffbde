#pragma once

#include "capture/dataset.h"

namespace atelier {

/// Says on standard error whose consent to a capture is over.
void tell_ended_consent(const Dataset& dataset);

}  // namespace atelier
