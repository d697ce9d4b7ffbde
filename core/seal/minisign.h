#pragma once

#include <array>
#include <string>
#include <string_view>

#include "core/seal/secret.h"

namespace atelier {

/// Whose signature it is: an Ed25519 public key in minisign's format
/// (https://jedisct1.github.io/minisign/, "Public key format").
struct SignatureKey {
  std::array<std::uint8_t, 8> id{};
  std::array<std::uint8_t, 32> key{};

  bool operator==(const SignatureKey&) const = default;
};

/// The secret key behind one.
struct SigningKey {
  SignatureKey key;
  Secret secret;  ///< 64 bytes
};

/// "RW...", the second line of a public key's file.
std::string signature_key_text(const SignatureKey& key);

/// Reads "RW...", alone or as a file with a comment above it. Throws DataError.
SignatureKey parse_signature_key(std::string_view text, const std::string& file);

/// A new key, from the system's random numbers.
SigningKey new_signing_key();

/// The file of a secret key, without a passphrase (`minisign -W`).
Secret signing_key_file(const SigningKey& key);

/// Reads the file of a secret key, with a passphrase where it has one. Throws DataError for damage,
/// a wrong passphrase, and a key that takes more than 1 GiB to open. Errors never show what is in
/// it.
SigningKey parse_signing_key(std::string_view text, const Secret& passphrase,
                             const std::string& file);

/// Whether the file of a secret key asks for a passphrase; false for what is none.
bool asks_for_passphrase(std::string_view text);

/// The file of a signature (`.minisig`): Ed25519 over the text's BLAKE2b-512, and over that and the
/// trusted comment.
/// @param comment  trusted: one printable line
std::string sign_text(std::string_view text, const SigningKey& key, const std::string& comment);

/// The trusted comment, as it is, of a signature that is the key's and the text's; both of
/// minisign's ways of hashing are read. Throws DataError for any other. @param file  the
/// signature's name for errors
std::string check_signature(std::string_view text, std::string_view signature,
                            const SignatureKey& key, const std::string& file);

/// A signature's file in one line without tabs, as a consent keeps it: signature, signature of
/// both, trusted comment. Throws DataError for a file that is none, or whose comment has a tab.
std::string signature_line(std::string_view signature, const std::string& file);

/// The file of a signature that is kept in one line.
std::string signature_of_line(std::string_view line);

/// What is wrong with a signature in one line of a text, as a sentence's end; "" where it is the
/// key's
/// ("RW...") and the text's.
std::string signature_problem(std::string_view text, std::string_view line, std::string_view key);

/// The id of the key that a signature names, as minisign prints it: 16 hexadecimal digits.
std::string key_id_text(const std::array<std::uint8_t, 8>& id);

}  // namespace atelier
