#pragma once

#include <array>

#include "core/seal/minisign.h"

namespace atelier {

/// Ed25519 (RFC 8032) over bytes as they are, without a file around it: as COSE and X.509 want it.
std::array<std::uint8_t, 64> sign_bytes(Bytes bytes, const SigningKey& key);

/// Whether a signature of 64 bytes is that of a public key of 32 bytes over these bytes; false for
/// other sizes.
bool is_signature(Bytes signature, Bytes bytes, Bytes key);

/// A key that everybody can derive from the text: its signature says that nothing was changed by
/// accident, and nothing of who signed. Always the same for a text.
SigningKey open_signing_key(std::string_view text);

}  // namespace atelier
