#include "core/seal/age_header.h"

#include <algorithm>
#include <array>
#include <optional>

#include <sodium.h>

#include "core/error.h"
#include "core/seal/base64.h"

namespace atelier {
namespace {

constexpr std::string_view kX25519 = "X25519";
constexpr std::string_view kScrypt = "scrypt";
constexpr std::string_view kX25519Info = "age-encryption.org/v1/X25519";
constexpr std::string_view kScryptSalt = "age-encryption.org/v1/scrypt";
constexpr std::size_t kLine = 64;  ///< letters of a whole line of a body
constexpr std::size_t kFileKey = 16;
constexpr std::size_t kWrapped = kFileKey + crypto_aead_chacha20poly1305_ietf_ABYTES;
constexpr std::size_t kMaxStanzas = 1024;
constexpr int kWork = 18;     ///< log2 of scrypt's N, of new files: 256 MiB, as age writes it
constexpr int kMaxWork = 20;  ///< of files that are read: 1 GiB
constexpr std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES> kNoNonce{};
constexpr std::array<std::uint8_t, 1> kZero{};
constexpr Bytes kNothing(kZero.data(), 0);

/// HMAC with SHA-256 of what stands in `first` and `second`; none of the three may be null.
Secret hmac(Bytes key, Bytes first, Bytes second = kNothing) {
  Secret mac(crypto_auth_hmacsha256_BYTES);
  crypto_auth_hmacsha256_state state;
  crypto_auth_hmacsha256_init(&state, key.data(), key.size());
  crypto_auth_hmacsha256_update(&state, first.data(), first.size());
  crypto_auth_hmacsha256_update(&state, second.data(), second.size());
  crypto_auth_hmacsha256_final(&state, mac.data());
  sodium_memzero(&state, sizeof state);
  return mac;
}

/// HKDF with SHA-256 (RFC 5869), 32 bytes of it.
Secret hkdf(Bytes key, Bytes salt, std::string_view info) {
  constexpr std::array<std::uint8_t, 1> kFirstBlock = {1};
  return hmac(hmac(salt, key).bytes(), bytes_of(info), kFirstBlock);
}

std::string wrapped(const Secret& key, const Secret& file_key) {
  std::array<std::uint8_t, kWrapped> body{};
  crypto_aead_chacha20poly1305_ietf_encrypt(body.data(), nullptr, file_key.data(), file_key.size(),
                                            nullptr, 0, nullptr, kNoNonce.data(), key.data());
  return base64_text(body, Base64::Unpadded);
}

std::optional<Secret> unwrapped(const Secret& key, Bytes body) {
  Secret file_key(kFileKey);
  if (crypto_aead_chacha20poly1305_ietf_decrypt(file_key.data(), nullptr, nullptr, body.data(),
                                                body.size(), nullptr, 0, kNoNonce.data(),
                                                key.data()) != 0) {
    return std::nullopt;
  }
  return file_key;
}

/// The key that wraps a file key for a recipient; nothing for a point of low order.
std::optional<Secret> x25519_key(const Secret& scalar, Bytes point, Bytes ephemeral,
                                 const Recipient& recipient) {
  Secret shared(crypto_scalarmult_BYTES);
  if (crypto_scalarmult(shared.data(), scalar.data(), point.data()) != 0) {
    return std::nullopt;
  }
  std::array<std::uint8_t, 64> salt{};
  std::copy(ephemeral.begin(), ephemeral.end(), salt.begin());
  std::copy(recipient.begin(), recipient.end(), salt.begin() + 32);
  return hkdf(shared.bytes(), salt, kX25519Info);
}

Secret scrypt_key(const Secret& passphrase, Bytes salt, int work) {
  std::string whole(kScryptSalt);
  whole.append(salt.begin(), salt.end());
  Secret key(crypto_aead_chacha20poly1305_ietf_KEYBYTES);
  constexpr std::uint32_t kBlock = 8;
  if (crypto_pwhash_scryptsalsa208sha256_ll(
          passphrase.data(), passphrase.size(), bytes_of(whole).data(), whole.size(),
          std::uint64_t{1} << work, kBlock, 1, key.data(), key.size()) != 0) {
    throw EnvironmentError("memory for scrypt", "there is not enough");
  }
  return key;
}

std::string mac_of(const Secret& file_key, std::string_view authenticated) {
  const Secret mac =
      hmac(hkdf(file_key.bytes(), kNothing, "header").bytes(), bytes_of(authenticated));
  return std::string(mac.text());
}

/// Walks over the lines of a header.
class HeaderLines {
 public:
  HeaderLines(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  std::string_view next() {
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string_view::npos) {
      fail("a header that does not end", "all of the file");
    }
    start_ = position_;
    position_ = end + 1;
    ++line_;
    return text_.substr(start_, end - start_);
  }
  std::size_t start() const { return start_; }        ///< of the last line
  std::size_t position() const { return position_; }  ///< behind it
  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw DataError(file_, "header, line " + std::to_string(line_), found, expected);
  }

 private:
  std::string_view text_;
  const std::string& file_;
  std::size_t start_ = 0;
  std::size_t position_ = 0;
  int line_ = 0;
};

AgeStanza parse_stanza(std::string_view line, HeaderLines& lines) {
  if (!line.starts_with("->")) {
    lines.fail("no stanza", "'-> ' and a recipient, or '---' and the end of the header");
  }
  AgeStanza stanza;
  std::string_view rest = line.substr(2);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' ', 1), rest.size());
    const std::string_view word = rest.substr(1, end - 1);
    if (rest.front() != ' ' || word.empty() ||
        !std::all_of(word.begin(), word.end(), [](char c) { return c > 32 && c < 127; })) {
      lines.fail("a stanza whose words are not parted by single spaces", "'-> X25519 ...'");
    }
    stanza.arguments.emplace_back(word);
    rest.remove_prefix(end);
  }
  if (stanza.arguments.empty()) {
    lines.fail("a stanza without a type", "'-> X25519 ...'");
  }
  std::string letters;
  std::string_view body;
  do {
    body = lines.next();
    if (body.size() > kLine) {
      lines.fail("a line of " + std::to_string(body.size()) + " letters", "at most 64");
    }
    letters += body;
  } while (body.size() == kLine);
  const auto bytes = base64_bytes(letters, Base64::Unpadded);
  if (!bytes) {
    lines.fail("no base64, or not as it is written", "base64 without padding");
  }
  stanza.body = *bytes;
  return stanza;
}

/// The bytes of a stanza's argument, of that size.
std::vector<std::uint8_t> argument_bytes(const AgeStanza& stanza, std::size_t which,
                                         std::size_t size, const std::string& file) {
  std::optional<std::vector<std::uint8_t>> bytes;
  if (which < stanza.arguments.size()) {
    bytes = base64_bytes(stanza.arguments[which], Base64::Unpadded);
  }
  if (!bytes || bytes->size() != size) {
    throw DataError(file, "header", "a stanza " + stanza.arguments[0] + " without its key",
                    std::to_string(size) + " bytes in base64");
  }
  return *bytes;
}

void require_shape(const AgeStanza& stanza, std::size_t arguments, const std::string& file) {
  if (stanza.arguments.size() != arguments || stanza.body.size() != kWrapped) {
    throw DataError(
        file, "header", "a stanza " + stanza.arguments[0] + " of another shape",
        std::to_string(arguments) + " words and " + std::to_string(kWrapped) + " bytes");
  }
}

std::optional<OpenedHeader> open_x25519(const AgeStanza& stanza,
                                        const std::vector<Identity>& identities,
                                        const std::string& file) {
  require_shape(stanza, 2, file);
  const std::vector<std::uint8_t> share = argument_bytes(stanza, 1, crypto_scalarmult_BYTES, file);
  for (const Identity& identity : identities) {
    const auto key = x25519_key(identity.secret, share, share, identity.recipient);
    if (!key) {
      throw DataError(file, "header", "a key share of low order", "one of a sound program");
    }
    if (auto file_key = unwrapped(*key, stanza.body)) {
      return OpenedHeader{std::move(*file_key), recipient_text(identity.recipient)};
    }
  }
  return std::nullopt;
}

std::optional<OpenedHeader> open_scrypt(const AgeStanza& stanza, const Secret& passphrase,
                                        const std::string& file) {
  require_shape(stanza, 3, file);
  constexpr std::size_t kSalt = 16;
  const std::vector<std::uint8_t> salt = argument_bytes(stanza, 1, kSalt, file);
  const std::string& digits = stanza.arguments[2];
  const bool number =
      (digits.size() == 1 || digits.size() == 2) && digits[0] != '0' &&
      std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  const int work = number ? std::stoi(digits) : 0;
  if (work < 1 || work > kMaxWork) {
    throw DataError(file, "header", "scrypt with 2^" + digits.substr(0, 10) + " rounds",
                    "at most 2^20, which take 1 GiB");
  }
  auto file_key = passphrase.size() == 0
                      ? std::nullopt
                      : unwrapped(scrypt_key(passphrase, salt, work), stanza.body);
  return file_key ? std::optional(OpenedHeader{std::move(*file_key), "a passphrase"})
                  : std::nullopt;
}

}  // namespace

std::size_t age_header_size(std::string_view start) {
  const std::size_t last = start.find("\n---");
  const std::size_t end =
      last == std::string_view::npos ? std::string_view::npos : start.find('\n', last + 1);
  return end == std::string_view::npos ? 0 : end + 1;
}

AgeHeader parse_age_header(std::string_view text, const std::string& file) {
  HeaderLines lines(text.substr(0, kMaxAgeHeader), file);
  if (!text.starts_with(kAgeVersionLine)) {
    throw DataError(file, "header", "no sealed file",
                    "one that begins with 'age-encryption.org/v1'");
  }
  lines.next();
  AgeHeader header;
  std::string_view line = lines.next();
  for (; !line.starts_with("---"); line = lines.next()) {
    header.stanzas.push_back(parse_stanza(line, lines));
    if (header.stanzas.size() > kMaxStanzas) {
      lines.fail("more than 1024 stanzas", "fewer");
    }
  }
  const auto mac = line.starts_with("--- ") ? base64_bytes(line.substr(4), Base64::Unpadded)
                                            : std::optional<std::vector<std::uint8_t>>();
  if (!mac || mac->size() != crypto_auth_hmacsha256_BYTES) {
    lines.fail("no MAC at the end of the header", "'--- ' and 32 bytes in base64");
  }
  if (header.stanzas.empty()) {
    lines.fail("no recipient", "at least one stanza");
  }
  header.mac = *mac;
  header.authenticated = std::string(text.substr(0, lines.start() + 3));
  header.size = lines.position();
  return header;
}

Digest age_header_digest(const AgeHeader& header) {
  return sha256(header.authenticated + " " + base64_text(header.mac, Base64::Unpadded) + "\n");
}

OpenedHeader open_age_header(const AgeHeader& header, const AgeKeys& keys,
                             const std::string& file) {
  start_sodium();
  std::optional<OpenedHeader> first;
  for (const AgeStanza& stanza : header.stanzas) {
    if (stanza.arguments[0] == kScrypt && header.stanzas.size() > 1) {
      throw DataError(file, "header", "a passphrase beside another recipient", "it alone");
    }
    std::optional<OpenedHeader> opened;
    if (stanza.arguments[0] == kX25519) {
      opened = open_x25519(stanza, keys.identities, file);
    } else if (stanza.arguments[0] == kScrypt) {
      opened = open_scrypt(stanza, keys.passphrase, file);
    }
    if (opened && !first) {
      first = std::move(opened);
    }
  }
  if (!first) {
    const bool by_passphrase = header.stanzas[0].arguments[0] == kScrypt;
    throw DataError(file, "",
                    by_passphrase ? (keys.passphrase.size() == 0 ? "sealed by a passphrase"
                                                                 : "another passphrase")
                    : keys.identities.empty() ? "sealed to keys, not by a passphrase"
                                              : "sealed to others",
                    by_passphrase ? "its passphrase: --passphrase-file FILE or --passphrase"
                                  : "the key of one to whom it is sealed: --identity FILE");
  }
  const std::string mac = mac_of(first->file_key, header.authenticated);
  if (sodium_memcmp(mac.data(), header.mac.data(), mac.size()) != 0) {
    throw DataError(file, "header", "a header that was changed", "the file as it was sealed");
  }
  return std::move(*first);
}

std::string new_age_header(const AgeRecipients& to, const Secret& file_key) {
  start_sodium();
  ATELIER_CHECK(to.recipients.empty() != (to.passphrase.size() == 0),
                "recipients, or a passphrase, and not both");
  std::string text(kAgeVersionLine);
  if (to.passphrase.size() > 0) {
    std::array<std::uint8_t, 16> salt{};
    randombytes_buf(salt.data(), salt.size());
    text += "-> scrypt " + base64_text(salt, Base64::Unpadded) + " " + std::to_string(kWork) +
            "\n" + wrapped(scrypt_key(to.passphrase, salt, kWork), file_key) + "\n";
  }
  for (const Recipient& recipient : to.recipients) {
    const Identity ephemeral = new_identity();
    const auto key = x25519_key(ephemeral.secret, recipient, ephemeral.recipient, recipient);
    if (!key) {
      throw DataError("", recipient_text(recipient), "a recipient of low order",
                      "the public key of somebody");
    }
    text += "-> X25519 " + base64_text(ephemeral.recipient, Base64::Unpadded) + "\n" +
            wrapped(*key, file_key) + "\n";
  }
  text += "---";
  const std::string mac = mac_of(file_key, text);
  return text + " " + base64_text(bytes_of(mac), Base64::Unpadded) + "\n";
}

Secret age_payload_key(const Secret& file_key, Bytes nonce) {
  return hkdf(file_key.bytes(), nonce, "payload");
}

}  // namespace atelier
