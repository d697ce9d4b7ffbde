#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "core/seal/secret.h"

namespace atelier {

/// Takes bytes on their way to a file.
using ByteSink = std::function<void(Bytes bytes)>;

/// Fills a buffer from a file: how many bytes it gave, fewer than asked for at the end alone.
using ByteSource = std::function<std::size_t(std::span<std::uint8_t> buffer)>;

}  // namespace atelier
