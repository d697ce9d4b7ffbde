#pragma once

#include <cstdint>

namespace atelier {

/// Films of more bytes get no content credentials, and theirs are not read: they are hashed in
/// memory.
inline constexpr std::int64_t kMostFilmBytes = std::int64_t{4} << 30;

}  // namespace atelier
