#include "core/io/zip_archive.h"
#include "fuzz/reader.h"

/// Every member inflated without keeping it; those that are small also whole.
ATELIER_FUZZ_READER(zip) {
  constexpr std::int64_t kSmall = 1 << 20;
  const atelier::ZipArchive zip({bytes.begin(), bytes.end()}, "zip");
  zip.check();
  for (const std::string& name : zip.names()) {
    ATELIER_CHECK(zip.contains(name), "a member that is listed is there");
    zip.read(name, kSmall);
  }
}
