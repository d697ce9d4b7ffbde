#include <string_view>

#include "core/seal/age_header.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(age_header) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const atelier::AgeHeader header = atelier::parse_age_header(text, "a.sealed");
  ATELIER_CHECK(!header.stanzas.empty() && header.size <= bytes.size(), "a header beyond the file");
  ATELIER_CHECK(header.size == atelier::age_header_size(text), "two ends of one header");
  atelier::AgeKeys keys;
  keys.identities = atelier::parse_identities(
      "AGE-SECRET-KEY-1GFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPQ4EGAEX", "key");
  atelier::open_age_header(header, keys, "a.sealed");
}
