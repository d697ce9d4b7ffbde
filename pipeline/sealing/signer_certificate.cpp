#include "pipeline/sealing/signer_certificate.h"

#include <algorithm>

#include "core/seal/raw_signature.h"
#include "core/sha256.h"

namespace atelier {
namespace {

// Tags of DER (ITU-T X.690).
constexpr char kInteger = 0x02;
constexpr char kBitString = 0x03;
constexpr char kOctetString = 0x04;
constexpr char kObjectName = 0x06;
constexpr char kText = 0x0C;
constexpr char kTime = 0x17;
constexpr char kSequence = 0x30;
constexpr char kSet = 0x31;
constexpr char kVersion = static_cast<char>(0xA0);
constexpr char kExtensions = static_cast<char>(0xA3);

// Object identifiers, encoded.
constexpr std::string_view kEd25519("\x2B\x65\x70");
constexpr std::string_view kCommonName("\x55\x04\x03");
constexpr std::string_view kOrganisation("\x55\x04\x0A");
constexpr std::string_view kBasicConstraints("\x55\x1D\x13");
constexpr std::string_view kKeyUsage("\x55\x1D\x0F");
constexpr std::string_view kExtendedUsage("\x55\x1D\x25");
constexpr std::string_view kSubjectKey("\x55\x1D\x0E");
constexpr std::string_view kAuthorityKey("\x55\x1D\x23");
constexpr std::string_view kEmailProtection("\x2B\x06\x01\x05\x05\x07\x03\x04");

/// An Ed25519 key as certificates have it, up to its 32 bytes.
constexpr std::string_view kKeyStart("\x30\x2A\x30\x05\x06\x03\x2B\x65\x70\x03\x21\x00", 12);

std::string der(char tag, std::string_view content) {
  std::string bytes(1, tag);
  const std::size_t size = content.size();
  if (size > 0xFF) {
    bytes += '\x82';
    bytes += static_cast<char>(size >> 8 & 0xFF);
  } else if (size > 0x7F) {
    bytes += '\x81';
  }
  bytes += static_cast<char>(size & 0xFF);
  return bytes.append(content);
}

std::string named(std::string_view kind, std::string_view text) {
  return der(kSet, der(kSequence, der(kObjectName, kind) + der(kText, text)));
}

std::string full_name(std::string_view common) {
  return der(kSequence, named(kOrganisation, "Atelier") + named(kCommonName, common));
}

std::string extension(std::string_view kind, bool critical, std::string_view value) {
  const std::string is_critical = critical ? std::string("\x01\x01\xFF", 3) : std::string();
  return der(kSequence, der(kObjectName, kind) + is_critical + der(kOctetString, value));
}

/// 20 bytes that stand for a key.
std::string key_name(Bytes key) {
  const Digest digest = sha256(key.data(), key.size());
  return {digest.begin(), digest.begin() + 20};
}

std::string bit_string(std::string_view bytes) {
  return der(kBitString, std::string(1, '\0').append(bytes));
}

std::string text_of_bytes(Bytes bytes) {
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::string signer_certificate(const SigningKey& key) {
  const SigningKey issuer = open_signing_key("issuer of " + signature_key_text(key.key));
  const std::string algorithm = der(kSequence, der(kObjectName, kEd25519));
  // Positive, whichever bit the id begins with.
  const std::string serial = '\x01' + text_of_bytes(key.key.id);
  const std::string extensions =
      extension(kBasicConstraints, true, der(kSequence, "")) +
      extension(kKeyUsage, true, der(kBitString, "\x07\x80")) +
      extension(kExtendedUsage, false, der(kSequence, der(kObjectName, kEmailProtection))) +
      extension(kSubjectKey, false, der(kOctetString, key_name(key.key.key))) +
      extension(kAuthorityKey, false,
                der(kSequence, der(static_cast<char>(0x80), key_name(issuer.key.key))));
  const std::string content =
      der(kVersion, der(kInteger, "\x02")) + der(kInteger, serial) + algorithm +
      full_name("nobody: this certificate names a key and vouches for nothing") +
      der(kSequence, der(kTime, "250101000000Z") + der(kTime, "491231235959Z")) +
      full_name(signature_key_text(key.key)) + std::string(kKeyStart) + text_of_bytes(key.key.key) +
      der(kExtensions, der(kSequence, extensions));
  const std::string signed_part = der(kSequence, content);
  const auto signature = sign_bytes(bytes_of(signed_part), issuer);
  return der(kSequence, signed_part + algorithm + bit_string(text_of_bytes(signature)));
}

std::optional<SignatureKey> key_of_certificate(std::string_view certificate) {
  const std::size_t start = certificate.find(kKeyStart);
  // Behind the headers of the certificate and of its signed part: version 3, then the serial
  // number.
  constexpr std::string_view kVersionThree("\xA0\x03\x02\x01\x02\x02", 6);
  const std::size_t version = certificate.find(kVersionThree);
  if (start == std::string_view::npos || version == std::string_view::npos ||
      certificate.size() < start + kKeyStart.size() + 32 ||
      certificate.size() < version + kVersionThree.size() + 1) {
    return std::nullopt;
  }
  SignatureKey key;
  std::copy_n(certificate.begin() + static_cast<std::ptrdiff_t>(start + kKeyStart.size()),
              key.key.size(), key.key.begin());
  const auto serial_size = static_cast<std::size_t>(
      static_cast<unsigned char>(certificate[version + kVersionThree.size()]));
  const std::string_view serial =
      certificate.substr(version + kVersionThree.size() + 1, serial_size);
  const std::size_t count = std::min(serial.size(), key.id.size());
  std::copy_n(serial.end() - static_cast<std::ptrdiff_t>(count), count,
              key.id.end() - static_cast<std::ptrdiff_t>(count));
  return key;
}

}  // namespace atelier
