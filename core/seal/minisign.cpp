#include "core/seal/minisign.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <vector>

#include <sodium.h>

#include "core/error.h"
#include "core/seal/base64.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::string_view kUntrusted = "untrusted comment: ";
constexpr std::string_view kTrusted = "trusted comment: ";
constexpr std::size_t kId = 8;
constexpr std::size_t kPublic = 2 + kId + crypto_sign_PUBLICKEYBYTES;
constexpr std::size_t kSignatureBytes = 2 + kId + crypto_sign_BYTES;
constexpr std::size_t kMaxFile = 16'384;

// Of the file of a secret key: algorithms, salt, scrypt's two limits, and what may be encrypted.
constexpr std::size_t kSalt = 6;
constexpr std::size_t kLimits = kSalt + crypto_pwhash_scryptsalsa208sha256_SALTBYTES;
constexpr std::size_t kSecret = kLimits + 16;
constexpr std::size_t kKeyChecksum = 32;
constexpr std::size_t kSecretBytes = kId + crypto_sign_SECRETKEYBYTES + kKeyChecksum;
constexpr std::size_t kSecretFile = kSecret + kSecretBytes;
constexpr std::uint64_t kMaxKeyMemory = std::uint64_t{1} << 30;
constexpr std::uint64_t kMaxKeyWork = std::uint64_t{1} << 26;

[[noreturn]] void fail(const std::string& file, const std::string& found,
                       const std::string& expected) {
  throw DataError(file, "", found, expected);
}

/// The lines of a text; the last may end without a line end.
std::vector<std::string_view> file_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

/// Bytes of a line, of that size; nothing for anything else.
std::optional<std::vector<std::uint8_t>> line_bytes(std::string_view line, std::size_t size) {
  auto bytes = base64_bytes(line, Base64::Padded);
  return bytes && bytes->size() == size ? bytes : std::nullopt;
}

template <std::size_t Size>
std::array<std::uint8_t, Size> part(Bytes bytes, std::size_t offset) {
  std::array<std::uint8_t, Size> result{};
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), Size, result.begin());
  return result;
}

std::uint64_t little(Bytes bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof value; ++i) {
    value |= std::uint64_t{bytes[offset + i]} << (8 * i);
  }
  return value;
}

std::array<std::uint8_t, 64> hashed(std::string_view text) {
  std::array<std::uint8_t, 64> hash{};
  crypto_generichash(hash.data(), hash.size(), bytes_of(text).data(), text.size(), nullptr, 0);
  return hash;
}

/// The bytes of a secret key's file; nothing for what is none.
std::optional<Secret> secret_file_bytes(std::string_view text) {
  start_sodium();
  const std::vector<std::string_view> lines = file_lines(text.substr(0, kMaxFile));
  const auto is_ascii = [](char c) { return c > 0; };
  if (lines.size() != 2 || !lines[0].starts_with(kUntrusted) ||
      !std::all_of(lines[1].begin(), lines[1].end(), is_ascii)) {
    return std::nullopt;
  }
  Secret bytes(kSecretFile);
  std::size_t size = 0;
  const char* end = nullptr;
  if (sodium_base642bin(bytes.data(), bytes.size(), lines[1].data(), lines[1].size(), nullptr,
                        &size, &end, sodium_base64_VARIANT_ORIGINAL) != 0 ||
      end != lines[1].data() + lines[1].size() || size != kSecretFile ||
      !bytes.text().starts_with("Ed") || bytes.text().substr(4, 2) != "B2") {
    return std::nullopt;
  }
  return bytes;
}

/// What minisign signs beside the text: the signature, then the trusted comment.
std::string under_global(Bytes signature, std::string_view comment) {
  std::string both(signature.begin(), signature.end());
  return both.append(comment);
}

}  // namespace

std::string key_id_text(const std::array<std::uint8_t, 8>& id) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text;
  for (std::size_t i = id.size(); i-- > 0;) {
    text += kDigits[id[i] >> 4];
    text += kDigits[id[i] & 15];
  }
  return text;
}

std::string signature_key_text(const SignatureKey& key) {
  std::string bytes = "Ed";
  bytes.append(key.id.begin(), key.id.end());
  bytes.append(key.key.begin(), key.key.end());
  return base64_text(bytes_of(bytes), Base64::Padded);
}

SignatureKey parse_signature_key(std::string_view text, const std::string& file) {
  std::vector<std::string_view> lines = file_lines(text.substr(0, kMaxFile));
  if (!lines.empty() && lines[0].starts_with(kUntrusted)) {
    lines.erase(lines.begin());
  }
  const auto bytes = lines.size() == 1 ? line_bytes(lines[0], kPublic) : std::nullopt;
  if (!bytes || (*bytes)[0] != 'E' || (*bytes)[1] != 'd') {
    fail(file, "no public key", "RW..., as minisign and atelier key --signing write it");
  }
  return {part<kId>(*bytes, 2), part<crypto_sign_PUBLICKEYBYTES>(*bytes, 2 + kId)};
}

SigningKey new_signing_key() {
  SigningKey key;
  key.secret = Secret(crypto_sign_SECRETKEYBYTES);
  crypto_sign_keypair(key.key.key.data(), key.secret.data());
  randombytes_buf(key.key.id.data(), key.key.id.size());
  return key;
}

Secret signing_key_file(const SigningKey& key) {
  Secret bytes(kSecretFile);
  std::memcpy(bytes.data(), "Ed\0\0B2", kSalt);
  std::copy(key.key.id.begin(), key.key.id.end(), bytes.data() + kSecret);
  std::memcpy(bytes.data() + kSecret + kId, key.secret.data(), key.secret.size());
  std::string base64 = base64_text(bytes.bytes(), Base64::Padded);
  std::string text = std::string(kUntrusted) + "minisign secret key of atelier\n" + base64 + "\n";
  Secret kept(bytes_of(text));
  sodium_memzero(base64.data(), base64.size());
  sodium_memzero(text.data(), text.size());
  return kept;
}

bool asks_for_passphrase(std::string_view text) {
  const auto bytes = secret_file_bytes(text);
  return bytes && bytes->text().substr(2, 2) == "Sc";
}

SigningKey parse_signing_key(std::string_view text, const Secret& passphrase,
                             const std::string& file) {
  auto bytes = secret_file_bytes(text);
  if (!bytes) {
    fail(file, "no secret key", "what minisign -G and atelier key --signing write");
  }
  std::uint8_t* secret = bytes->data() + kSecret;
  const std::string_view kind = bytes->text().substr(2, 2);
  if (kind == "Sc") {
    const std::uint64_t work = little(bytes->bytes(), kLimits);
    const std::uint64_t memory = little(bytes->bytes(), kLimits + 8);
    if (work > kMaxKeyWork || memory > kMaxKeyMemory) {
      fail(file, "a key that takes more than 1 GiB to open", "one of minisign's");
    }
    Secret stream(kSecretBytes);
    if (passphrase.size() == 0) {
      fail(file, "a key with a passphrase", "its passphrase");
    }
    if (crypto_pwhash_scryptsalsa208sha256(stream.data(), stream.size(), passphrase.text().data(),
                                           passphrase.size(), bytes->data() + kSalt, work,
                                           static_cast<std::size_t>(memory)) != 0) {
      throw EnvironmentError("memory for scrypt", "there is not enough");
    }
    for (std::size_t i = 0; i < stream.size(); ++i) {
      secret[i] ^= stream.data()[i];
    }
    Secret checked(2 + kId + crypto_sign_SECRETKEYBYTES);
    std::memcpy(checked.data(), "Ed", 2);
    std::memcpy(checked.data() + 2, secret, checked.size() - 2);
    std::array<std::uint8_t, kKeyChecksum> sum{};
    crypto_generichash(sum.data(), sum.size(), checked.data(), checked.size(), nullptr, 0);
    if (sodium_memcmp(sum.data(), secret + kSecretBytes - kKeyChecksum, kKeyChecksum) != 0) {
      fail(file, "another passphrase", "the one of the key");
    }
  } else if (kind != std::string_view("\0\0", 2)) {
    fail(file, "a key that is encrypted otherwise", "one of minisign's");
  }
  SigningKey key;
  key.secret = Secret(bytes->bytes().subspan(kSecret + kId, crypto_sign_SECRETKEYBYTES));
  key.key.id = part<kId>(bytes->bytes(), kSecret);
  // The second half of the secret is the public key; a pair that does not fit signs for nobody.
  std::array<std::uint8_t, crypto_sign_SEEDBYTES> seed{};
  crypto_sign_ed25519_sk_to_seed(seed.data(), key.secret.data());
  Secret again(crypto_sign_SECRETKEYBYTES);
  crypto_sign_seed_keypair(key.key.key.data(), again.data(), seed.data());
  sodium_memzero(seed.data(), seed.size());
  if (sodium_memcmp(again.data(), key.secret.data(), again.size()) != 0) {
    fail(file, "a damaged secret key", "it as it was written");
  }
  return key;
}

std::string sign_text(std::string_view text, const SigningKey& key, const std::string& comment) {
  start_sodium();
  ATELIER_CHECK(is_printable_utf8(comment), "a trusted comment is one printable line");
  const auto hash = hashed(text);
  std::array<std::uint8_t, crypto_sign_BYTES> signature{};
  crypto_sign_detached(signature.data(), nullptr, hash.data(), hash.size(), key.secret.data());
  const std::string both = under_global(signature, comment);
  std::array<std::uint8_t, crypto_sign_BYTES> global{};
  crypto_sign_detached(global.data(), nullptr, bytes_of(both).data(), both.size(),
                       key.secret.data());
  std::string bytes = "ED";
  bytes.append(key.key.id.begin(), key.key.id.end());
  bytes.append(signature.begin(), signature.end());
  return std::string(kUntrusted) + "signature from atelier\n" +
         base64_text(bytes_of(bytes), Base64::Padded) + "\n" + std::string(kTrusted) + comment +
         "\n" + base64_text(global, Base64::Padded) + "\n";
}

std::string signature_line(std::string_view signature, const std::string& file) {
  const std::vector<std::string_view> lines = file_lines(signature.substr(0, kMaxFile));
  if (lines.size() != 4 || !lines[2].starts_with(kTrusted)) {
    fail(file, "no signature", "the four lines that minisign -S writes");
  }
  const std::string_view comment = lines[2].substr(kTrusted.size());
  if (!is_printable_utf8(comment)) {
    fail(file, "a trusted comment with a tab", "one of your own: minisign -S -t 'a consent'");
  }
  return std::string(lines[1]) + " " + std::string(lines[3]) + " " + std::string(comment);
}

std::string signature_of_line(std::string_view line) {
  const std::size_t first = std::min(line.find(' '), line.size());
  const std::size_t second = std::min(line.find(' ', first + 1), line.size());
  const std::size_t start = std::min(first + 1, second);
  const std::string_view global = line.substr(start, second - start);
  const std::string_view comment = line.substr(std::min(second + 1, line.size()));
  return std::string(kUntrusted) + "signature\n" + std::string(line.substr(0, first)) + "\n" +
         std::string(kTrusted) + std::string(comment) + "\n" + std::string(global) + "\n";
}

std::string check_signature(std::string_view text, std::string_view signature,
                            const SignatureKey& key, const std::string& file) {
  start_sodium();
  const std::vector<std::string_view> lines = file_lines(signature.substr(0, kMaxFile));
  if (lines.size() != 4 || !lines[0].starts_with(kUntrusted) || !lines[2].starts_with(kTrusted)) {
    fail(file, "no signature", "the four lines that minisign -S writes");
  }
  const auto bytes = line_bytes(lines[1], kSignatureBytes);
  const auto global = line_bytes(lines[3], crypto_sign_BYTES);
  const bool prehashed = bytes && (*bytes)[0] == 'E' && (*bytes)[1] == 'D';
  if (!bytes || !global || (*bytes)[0] != 'E' || (!prehashed && (*bytes)[1] != 'd')) {
    fail(file, "no signature", "the four lines that minisign -S writes");
  }
  if (part<kId>(*bytes, 2) != key.id) {
    fail(file, "a signature by the key " + key_id_text(part<kId>(*bytes, 2)),
         "one by " + key_id_text(key.id));
  }
  const Bytes body = Bytes(*bytes).subspan(2 + kId);
  const auto hash = hashed(text);
  const Bytes message = prehashed ? Bytes(hash) : bytes_of(text);
  std::string comment(lines[2].substr(kTrusted.size()));
  const std::string both = under_global(body, comment);
  if (crypto_sign_verify_detached(body.data(), message.data(), message.size(), key.key.data()) !=
          0 ||
      crypto_sign_verify_detached(global->data(), bytes_of(both).data(), both.size(),
                                  key.key.data()) != 0) {
    fail(file, "a signature that is not of this text", "the text as it was signed");
  }
  return comment;
}

std::string signature_problem(std::string_view text, std::string_view line, std::string_view key) {
  if (line.empty()) {
    return "names a key and has no signature";
  }
  if (key.empty()) {
    return "has a signature and names no key";
  }
  try {
    check_signature(text, signature_of_line(line), parse_signature_key(key, ""), "");
  } catch (const DataError& error) {
    return "is signed wrongly: " + error.found;
  }
  return "";
}

}  // namespace atelier
