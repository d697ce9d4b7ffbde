#pragma once

#include <span>

#include "core/store/stage.h"

namespace atelier {

/// Every stage that exists, in the order of the pipeline.
std::span<const Stage> all_stages();

}  // namespace atelier
