#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/seal/secret.h"

namespace atelier {

/// Somebody to whom a file is sealed: an X25519 public key, "age1..." as text (the age file
/// encryption format v1, https://age-encryption.org/v1, section "The X25519 recipient type").
using Recipient = std::array<std::uint8_t, 32>;

/// The secret key behind a recipient, "AGE-SECRET-KEY-1..." as text.
struct Identity {
  Secret secret;  ///< 32 bytes
  Recipient recipient{};
};

/// A new one, from the system's random numbers.
Identity new_identity();

std::string recipient_text(const Recipient& recipient);

/// Throws DataError for anything but "age1..." of 32 bytes. @param file, where  of the text, for
/// errors
Recipient parse_recipient(std::string_view text, const std::string& file = "",
                          const std::string& where = "");

/// A file of recipients: one a line; empty lines and comments (#) are passed over. Throws
/// DataError, also where there is none, or more than 1,024.
std::vector<Recipient> parse_recipients(std::string_view text, const std::string& file);

/// A key file as age-keygen writes it: a comment with the recipient, and the secret key.
Secret identity_text(const Identity& identity);

/// A file of identities, as age-keygen writes it: one a line; empty lines and comments (#) are
/// passed over. Errors name the line and never what stands in it. Throws DataError, also where
/// there is none, or more than 1,024.
std::vector<Identity> parse_identities(std::string_view text, const std::string& file);
std::vector<Identity> read_identities(const std::filesystem::path& path);

}  // namespace atelier
