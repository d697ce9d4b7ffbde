#include <vector>

#include "core/seal/tar.h"
#include "fuzz/read_on.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(sealed_archive) {
  std::size_t at = 0;
  atelier::TarReader archive(read_on(bytes, at), "archive");
  std::vector<std::uint8_t> piece(1000);
  for (auto entry = archive.next(); entry; entry = archive.next()) {
    ATELIER_CHECK(atelier::is_safe_tar_path(entry->path), "a path that leaves the folder");
    ATELIER_CHECK(entry->kind != atelier::TarEntry::Kind::Link ||
                      atelier::is_safe_tar_link(entry->path, entry->target),
                  "a link to elsewhere");
    archive.read(piece);
  }
  ATELIER_CHECK(at == bytes.size(), "an archive that was not read to its end");
}
