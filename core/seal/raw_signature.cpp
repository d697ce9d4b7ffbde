#include "core/seal/raw_signature.h"

#include <algorithm>

#include <sodium.h>

namespace atelier {

std::array<std::uint8_t, 64> sign_bytes(Bytes bytes, const SigningKey& key) {
  start_sodium();
  std::array<std::uint8_t, 64> signature{};
  static_assert(crypto_sign_BYTES == std::tuple_size_v<decltype(signature)>);
  crypto_sign_detached(signature.data(), nullptr, bytes.data(), bytes.size(), key.secret.data());
  return signature;
}

bool is_signature(Bytes signature, Bytes bytes, Bytes key) {
  start_sodium();
  return signature.size() == crypto_sign_BYTES && key.size() == crypto_sign_PUBLICKEYBYTES &&
         crypto_sign_verify_detached(signature.data(), bytes.data(), bytes.size(), key.data()) == 0;
}

SigningKey open_signing_key(std::string_view text) {
  start_sodium();
  std::array<std::uint8_t, crypto_sign_SEEDBYTES + std::tuple_size_v<decltype(SignatureKey::id)>>
      hash{};
  crypto_generichash(hash.data(), hash.size(), bytes_of(text).data(), text.size(), nullptr, 0);
  SigningKey key;
  key.secret = Secret(crypto_sign_SECRETKEYBYTES);
  crypto_sign_seed_keypair(key.key.key.data(), key.secret.data(), hash.data());
  std::copy_n(hash.begin() + crypto_sign_SEEDBYTES, key.key.id.size(), key.key.id.begin());
  return key;
}

}  // namespace atelier
