#include "core/io/lz4_block.h"

#include <algorithm>
#include <cstdint>

#include "core/error.h"

namespace atelier {

std::vector<std::byte> lz4_block(std::span<const std::byte> block, std::size_t most,
                                 const std::string& file, const std::string& place) {
  std::vector<std::byte> out;
  std::size_t at = 0;
  const auto refuse = [&](const std::string& found) {
    throw DataError(file, place, found + " at byte " + std::to_string(at) + " of the compressed",
                    "an LZ4 block of at most " + std::to_string(most) + " bytes");
  };
  const auto byte = [&]() {
    if (at >= block.size()) {
      refuse("the end");
    }
    return static_cast<std::size_t>(block[at++]);
  };
  // A length of 15 goes on in bytes, up to one below 255.
  const auto length = [&](std::size_t begin) {
    for (std::size_t next = begin == 15 ? 255 : 0; next == 255;) {
      next = byte();
      begin += next;
      if (begin > most) {
        refuse("a length of " + std::to_string(begin));
      }
    }
    return begin;
  };
  while (at < block.size()) {
    const std::size_t token = byte();
    const std::size_t literals = length(token >> 4);
    if (literals > block.size() - at || literals > most - out.size()) {
      refuse(std::to_string(literals) + " bytes as they are");
    }
    const auto from = block.begin() + static_cast<std::ptrdiff_t>(at);
    out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(literals));
    at += literals;
    if (at == block.size()) {
      break;  // the last sequence has no match
    }
    const std::size_t low = byte();
    const std::size_t offset = low | byte() << 8;
    constexpr std::size_t kShortest = 4;
    const std::size_t match = length(token & 15) + kShortest;
    if (offset == 0 || offset > out.size() || match > most - out.size()) {
      refuse(std::to_string(match) + " bytes from " + std::to_string(offset) + " before");
    }
    for (std::size_t i = 0; i < match; ++i) {
      out.push_back(out[out.size() - offset]);
    }
  }
  return out;
}

}  // namespace atelier
