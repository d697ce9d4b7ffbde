#include "core/archive.h"
#include "core/sequence_archive.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

namespace {

constexpr const char* kSchema = "atelier.mesh";

}  // namespace

ATELIER_FUZZ_READER(archive) {
  const std::vector<std::byte> forged = atelier::fuzz::with_right_digest(bytes);
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
