#pragma once

#include <string>
#include <string_view>

#include "core/seal/minisign.h"

namespace atelier {

/// A detached signature as C2PA keeps it: COSE_Sign1 (RFC 9052) with its certificate in the
/// protected header.
std::string cose_signature(std::string_view text, const SigningKey& key);

/// Contents of a signature, not yet verified.
struct CoseSignature {
  std::string_view header;       ///< protected, encoded
  std::string_view certificate;  ///< the first, DER; "" where there is none
  std::string_view signature;
  bool is_ed25519 = false;  ///< EdDSA
};

/// Reads one; the views are into `bytes`. Throws DataError.
CoseSignature read_cose_signature(std::string_view bytes, const std::string& file);

/// The text that such a signature signs.
std::string cose_signed_text(std::string_view header, std::string_view text);

}  // namespace atelier
