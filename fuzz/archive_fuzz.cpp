#include <algorithm>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/archive_index.h"
#include "core/sequence_archive.h"
#include "core/sha256.h"
#include "fuzz/reader.h"

namespace {

constexpr const char* kSchema = "atelier.mesh";

/// The digest refuses all damage. To see what is behind it, a second try has the digest put right,
/// as somebody with bad intentions would.
std::vector<std::byte> with_right_digest(std::span<const std::byte> bytes) {
  std::vector<std::byte> forged(bytes.begin(), bytes.end());
  if (forged.size() >= atelier::kArchiveFirstLine) {
    const std::string digest = atelier::hex(atelier::sha256(
        forged.data() + atelier::kArchiveFirstLine, forged.size() - atelier::kArchiveFirstLine));
    const auto text = std::as_bytes(std::span(digest));
    std::copy(text.begin(), text.end(), forged.begin() + atelier::kArchiveMagic.size());
  }
  return forged;
}

}  // namespace

ATELIER_FUZZ_READER(archive) {
  const std::vector<std::byte> forged = with_right_digest(bytes);
  const atelier::Archive archive = atelier::parse_archive(forged, kSchema, 1, "archive");
  std::size_t held = 0;
  for (const auto& [name, tensor] : archive.datasets) {
    atelier::check_tensor(tensor);
    held += tensor.data.size();
  }
  ATELIER_CHECK(held <= bytes.size(), "an archive held more than its bytes");
  check_mesh(atelier::mesh_of(archive, "archive"));
  // Without the right digest it must not be read at all.
  atelier::parse_archive(bytes, kSchema, 1, "archive");
}
