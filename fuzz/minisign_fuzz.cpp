#include <string_view>

#include "core/seal/minisign.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(minisign) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const atelier::SignatureKey key = atelier::parse_signature_key(
      "RWTHwUwqspNYY5NzLkMERs1+UcYBn2K+rpQ5sEi6G8PJmd5X7BMuzmlJ", "key");
  try {
    atelier::parse_signature_key(text, "key");
    return;
  } catch (const atelier::DataError&) {
  }
  try {
    atelier::parse_signing_key(text, atelier::Secret(), "key");
    return;
  } catch (const atelier::DataError&) {
  }
  if (atelier::signature_problem("text", text,
                                 "RWTHwUwqspNYY5NzLkMERs1+UcYBn2K+rpQ5sEi6G8PJmd5X7BMuzmlJ")
          .empty()) {
    return;  // a signature in one line
  }
  atelier::signature_line(text, "a.minisig");
  atelier::check_signature("text", text, key, "a.minisig");
}
