#pragma once

#include <cstdint>

namespace atelier {

/// Larger videos get no content credentials, and credentials of theirs are not read: videos are
/// hashed in memory.
inline constexpr std::int64_t kMaxVideoBytes = std::int64_t{4} << 30;

}  // namespace atelier
