#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/seal/minisign.h"

namespace atelier {

/// A certificate (X.509 v3, DER) of a signing key, as C2PA wants one beside a signature. Nobody
/// vouches for it: its issuer is a key that everybody can derive, and a validator calls it
/// untrusted. Its serial number is the key's id, so that the key can be told as minisign writes it.
std::string signer_certificate(const SigningKey& key);

/// The key of such a certificate: of any with an Ed25519 key, the id of another's is its serial
/// number's end. Nothing for a certificate of another kind of key.
std::optional<SignatureKey> key_of_certificate(std::string_view certificate);

}  // namespace atelier
