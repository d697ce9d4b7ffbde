#pragma once

#include <cstdint>

#include "core/limits.h"

namespace atelier {

/// Files that a folder may hold, an input or the outputs of a stage: 220 cameras of 18,000 frames.
inline constexpr std::int64_t kMaxFiles = 4'000'000;

/// The limits of the manifest of a result of this workspace, which names so many outputs: more than
/// JSON from elsewhere may hold.
Limits manifest_limits();

}  // namespace atelier
