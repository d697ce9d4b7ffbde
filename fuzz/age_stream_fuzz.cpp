#include <algorithm>
#include <vector>

#include "core/seal/age_stream.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(age_stream) {
  std::size_t at = 0;
  atelier::AgeKeys keys;
  keys.identities = atelier::parse_identities(
      "AGE-SECRET-KEY-1GFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPQ4EGAEX", "key");
  atelier::AgeReader reader(
      [&](std::span<std::uint8_t> buffer) {
        const std::size_t count = std::min(buffer.size(), bytes.size() - at);
        std::transform(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                       bytes.begin() + static_cast<std::ptrdiff_t>(at + count), buffer.begin(),
                       [](std::byte byte) { return static_cast<std::uint8_t>(byte); });
        at += count;
        return count;
      },
      keys, "a.sealed");
  std::vector<std::uint8_t> piece(1000);
  std::size_t plain = 0;
  for (std::size_t got = piece.size(); got == piece.size(); plain += got) {
    got = reader.read(piece);
  }
  ATELIER_CHECK(at == bytes.size(), "a file that was not read to its end");
  ATELIER_CHECK(plain < bytes.size(), "more than the file holds");
}
