#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/seal/age_keys.h"
#include "core/sha256.h"

namespace atelier {

/// The first line of every sealed file.
inline constexpr std::string_view kAgeVersionLine = "age-encryption.org/v1\n";

/// A header ends within so many bytes.
inline constexpr std::size_t kMaxAgeHeader = std::size_t{256} << 10;

/// One recipient's wrapping of the file key.
struct AgeStanza {
  std::vector<std::string> arguments;  ///< the first is its type: "X25519", "scrypt", another
  std::vector<std::uint8_t> body;
};

/// The header of a sealed file (age-encryption.org/v1, section "Header"): whoever holds the file
/// key checks `mac` over `authenticated`.
struct AgeHeader {
  std::vector<AgeStanza> stanzas;  ///< at least one
  std::string authenticated;       ///< the bytes under the MAC
  std::vector<std::uint8_t> mac;   ///< 32 bytes
  std::size_t size = 0;            ///< bytes of all of it; the payload follows
};

/// Where the header ends in the first bytes of a file, so that it can be parsed; 0 where it does
/// not end there.
std::size_t age_header_size(std::string_view start);

/// Reads the header that `text` begins with. One that is not exactly as the format says is refused:
/// padding, lines of another length, spare bits. Throws DataError.
AgeHeader parse_age_header(std::string_view text, const std::string& file);

/// SHA-256 of a header, by which a sealed file is told from every other: each has random key shares
/// and a random file key. Only whoever can open a file can make another with the same header.
Digest age_header_digest(const AgeHeader& header);

/// The keys of one who opens a file.
struct AgeKeys {
  std::vector<Identity> identities;
  Secret passphrase;  ///< empty: none
};

/// The result of opening a header with a key.
struct OpenedHeader {
  Secret file_key;  ///< 16 bytes
  std::string by;   ///< the recipient whose key fits, "age1...", or "a passphrase"
};

/// Opens a header with the first key that fits, once the MAC agrees. Throws DataError where none
/// does, where a stanza is malformed, or where the header was changed.
OpenedHeader open_age_header(const AgeHeader& header, const AgeKeys& keys, const std::string& file);

/// Those to whom a file is sealed: recipients, or all who know a passphrase (scrypt, N = 2^18).
struct AgeRecipients {
  std::vector<Recipient> recipients;
  Secret passphrase;  ///< empty: none; else the only one (the format allows no other beside it)
};

/// The header of a new file with that file key.
std::string new_age_header(const AgeRecipients& to, const Secret& file_key);

/// The key of the payload behind a header. @param nonce  16 bytes, before the payload
Secret age_payload_key(const Secret& file_key, Bytes nonce);

}  // namespace atelier
