#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace atelier::fuzz {

/// Reads bytes in memory as a stream: each call fills a buffer with what follows.
/// @param at  how many were read; outlives the stream
inline std::function<std::size_t(std::span<std::uint8_t>)> read_on(std::span<const std::byte> bytes,
                                                                   std::size_t& at) {
  return [bytes, &at](std::span<std::uint8_t> buffer) {
    const std::size_t count = std::min(buffer.size(), bytes.size() - at);
    std::transform(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                   bytes.begin() + static_cast<std::ptrdiff_t>(at + count), buffer.begin(),
                   [](std::byte byte) { return static_cast<std::uint8_t>(byte); });
    at += count;
    return count;
  };
}

}  // namespace atelier::fuzz
