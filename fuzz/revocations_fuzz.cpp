#include <string_view>

#include "fuzz/reader.h"
#include "pipeline/sealing/consent_check.h"

ATELIER_FUZZ_READER(revocations) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const std::string& id : atelier::parse_revocations(text, "revoked")) {
    ATELIER_CHECK(id.size() == 16, "an id of another length");
  }
}
