#include <string_view>

#include "core/seal/age_keys.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(age_keys) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    for (const atelier::Recipient& one : atelier::parse_recipients(text, "recipients")) {
      ATELIER_CHECK(atelier::parse_recipient(atelier::recipient_text(one)) == one,
                    "a recipient that is another one once it is written");
    }
  } catch (const atelier::DataError&) {
    for (const atelier::Identity& one : atelier::parse_identities(text, "identities")) {
      ATELIER_CHECK(atelier::parse_identities(atelier::identity_text(one).text(), "").size() == 1,
                    "an identity that cannot be read once it is written");
    }
  }
}
