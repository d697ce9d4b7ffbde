#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/archive_index.h"
#include "core/sha256.h"

namespace atelier::fuzz {

/// The bytes of an archive with its digest put right, as somebody with bad intentions would: the
/// digest refuses all damage, and what is behind it would never be tried.
inline std::vector<std::byte> with_right_digest(std::span<const std::byte> bytes) {
  std::vector<std::byte> forged(bytes.begin(), bytes.end());
  if (forged.size() >= kArchiveFirstLine) {
    const std::string digest =
        hex(sha256(forged.data() + kArchiveFirstLine, forged.size() - kArchiveFirstLine));
    const auto text = std::as_bytes(std::span(digest));
    std::copy(text.begin(), text.end(), forged.begin() + kArchiveMagic.size());
  }
  return forged;
}

}  // namespace atelier::fuzz
