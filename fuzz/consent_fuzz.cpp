#include <string_view>

#include "core/store/consent_file.h"
#include "core/utf8.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(consent) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::vector<atelier::Consent> all = atelier::parse_consent(text, "capture.toml");
  for (const atelier::Consent& one : all) {
    ATELIER_CHECK(!one.who.empty() && !one.scope.empty(), "a consent of nobody or for nothing");
    ATELIER_CHECK(atelier::is_printable_utf8(one.who + one.scope + one.until),
                  "a consent that cannot be shown");
  }
  atelier::ended_consent(all, 2e9);
}
