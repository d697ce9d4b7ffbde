#include "core/seal/age_keys.h"

#include <algorithm>
#include <utility>

#include <sodium.h>

#include "core/error.h"
#include "core/seal/bech32.h"

namespace atelier {
namespace {

constexpr std::string_view kRecipient = "age";
constexpr std::string_view kIdentity = "age-secret-key-";
constexpr std::size_t kMaxKeys = 1024;

/// Calls `take` with each line that says something, and its number.
template <class Take>
void each_line(std::string_view text, const Take& take) {
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    if (!line.empty() && !line.starts_with('#')) {
      take(line, "line " + std::to_string(number));
    }
  }
}

Recipient public_key(const Secret& secret) {
  Recipient recipient{};
  crypto_scalarmult_base(recipient.data(), secret.data());
  return recipient;
}

template <class Keys>
Keys checked(Keys keys, const std::string& file, const char* what) {
  if (keys.empty() || keys.size() > kMaxKeys) {
    throw DataError(file, "", keys.empty() ? "no key" : "more than 1024 keys", what);
  }
  return keys;
}

}  // namespace

Identity new_identity() {
  Identity identity;
  identity.secret = Secret(identity.recipient.size());
  randombytes_buf(identity.secret.data(), identity.secret.size());
  identity.recipient = public_key(identity.secret);
  return identity;
}

std::string recipient_text(const Recipient& recipient) {
  return bech32_text(kRecipient, recipient);
}

Recipient parse_recipient(std::string_view text, const std::string& file,
                          const std::string& where) {
  Recipient recipient{};
  if (!read_bech32(text, kRecipient, recipient)) {
    throw DataError(file, where,
                    text.starts_with("AGE-SECRET-KEY-")
                        ? "a secret key"
                        : "'" + std::string(text.substr(0, 80)) + "'",
                    "a recipient, age1..., whole and without a slip of the pen");
  }
  return recipient;
}

std::vector<Recipient> parse_recipients(std::string_view text, const std::string& file) {
  std::vector<Recipient> recipients;
  each_line(text, [&](std::string_view line, const std::string& where) {
    recipients.push_back(parse_recipient(line, file, where));
  });
  return checked(std::move(recipients), file, "recipients, age1..., one a line");
}

Secret identity_text(const Identity& identity) {
  std::string key = bech32_text(kIdentity, identity.secret.bytes());
  std::transform(key.begin(), key.end(), key.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  std::string text = "# public key: " + recipient_text(identity.recipient) + "\n" + key + "\n";
  Secret kept(bytes_of(text));
  sodium_memzero(key.data(), key.size());
  sodium_memzero(text.data(), text.size());
  return kept;
}

std::vector<Identity> parse_identities(std::string_view text, const std::string& file) {
  std::vector<Identity> identities;
  each_line(text, [&](std::string_view line, const std::string& where) {
    Identity identity;
    identity.secret = Secret(identity.recipient.size());
    if (line.starts_with("age1") || !read_bech32(line, kIdentity, identity.secret.writable())) {
      throw DataError(file, where, line.starts_with("age1") ? "a recipient" : "no secret key",
                      "AGE-SECRET-KEY-1..., as age-keygen or atelier key writes it");
    }
    identity.recipient = public_key(identity.secret);
    identities.push_back(std::move(identity));
    if (identities.size() > kMaxKeys) {
      throw DataError(file, where, "more than 1024 keys", "fewer");
    }
  });
  return checked(std::move(identities), file, "AGE-SECRET-KEY-1..., as age-keygen writes it");
}

std::vector<Identity> read_identities(const std::filesystem::path& path) {
  return parse_identities(read_secret_file(path).text(), path.string());
}

}  // namespace atelier
