#include <vector>

#include "core/seal/age_stream.h"
#include "fuzz/read_on.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(age_stream) {
  std::size_t at = 0;
  atelier::AgeKeys keys;
  keys.identities = atelier::parse_identities(
      "AGE-SECRET-KEY-1GFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPQ4EGAEX", "key");
  atelier::AgeReader reader(read_on(bytes, at), keys, "a.sealed");
  std::vector<std::uint8_t> piece(1000);
  std::size_t plain = 0;
  for (std::size_t got = piece.size(); got == piece.size(); plain += got) {
    got = reader.read(piece);
  }
  ATELIER_CHECK(at == bytes.size(), "a file that was not read to its end");
  ATELIER_CHECK(plain < bytes.size(), "more than the file holds");
}
