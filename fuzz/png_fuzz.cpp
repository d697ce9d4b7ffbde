#include <cstring>
#include <vector>

#include <zlib.h>

#include "core/io/image_file.h"
#include "fuzz/reader.h"

namespace {

/// The bytes with every chunk's checksum made right, so that damage gets past it.
std::vector<std::byte> with_checksums(std::span<const std::byte> bytes) {
  std::vector<std::byte> repaired(bytes.begin(), bytes.end());
  const auto big = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      value = value << 8 | static_cast<std::uint32_t>(repaired[at + i]);
    }
    return std::size_t{value};
  };
  for (std::size_t at = 8; at + 12 <= repaired.size();) {
    const std::size_t length = big(at);
    if (length > repaired.size() - at - 12) {
      break;
    }
    const auto crc = crc32(0, reinterpret_cast<const unsigned char*>(&repaired[at + 4]),
                           static_cast<unsigned>(length + 4));
    for (std::size_t i = 0; i < 4; ++i) {
      repaired[at + 8 + length + i] = static_cast<std::byte>(crc >> (24 - 8 * i) & 0xFF);
    }
    at += 12 + length;
  }
  return repaired;
}

}  // namespace

ATELIER_FUZZ_READER(png) {
  const std::vector<std::byte> repaired = with_checksums(bytes);
  try {
    atelier::read_image(repaired, "png", {.keep_alpha = true});
    atelier::read_labels(repaired, "png");
  } catch (const atelier::DataError&) {
    // The bytes as they came may be refused for another reason.
  }
  atelier::read_image(bytes, "png", {.keep_alpha = true});
}
