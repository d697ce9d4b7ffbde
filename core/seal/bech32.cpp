#include "core/seal/bech32.h"

#include <algorithm>
#include <array>

namespace atelier {
namespace {

constexpr std::string_view kLetters = "qpzry9x8gf2tvdw0s3jn54khce6mua7l";
constexpr std::size_t kChecksum = 6;

/// The checksum's polynomial over groups of five bits.
class Checksum {
 public:
  explicit Checksum(std::string_view prefix) {
    for (const char c : prefix) {
      add(static_cast<std::uint8_t>(c) >> 5);
    }
    add(0);
    for (const char c : prefix) {
      add(static_cast<std::uint8_t>(c) & 31);
    }
  }
  void add(std::uint32_t five_bits) {
    constexpr std::array<std::uint32_t, 5> kGenerator = {0x3b6a57b2, 0x26508e6d, 0x1ea119fa,
                                                         0x3d4233dd, 0x2a1462b3};
    const std::uint32_t top = value_ >> 25;
    value_ = ((value_ & 0x1ffffff) << 5) ^ five_bits;
    for (std::size_t i = 0; i < kGenerator.size(); ++i) {
      value_ ^= ((top >> i) & 1U) != 0 ? kGenerator[i] : 0;
    }
  }
  std::uint32_t value() const { return value_; }

 private:
  std::uint32_t value_ = 1;
};

}  // namespace

std::string bech32_text(std::string_view prefix, Bytes bytes) {
  std::string text = std::string(prefix) + "1";
  Checksum checksum(prefix);
  const auto add = [&](std::uint32_t five_bits) {
    checksum.add(five_bits);
    text += kLetters[five_bits];
  };
  std::uint32_t bits = 0;
  int count = 0;
  for (const std::uint8_t byte : bytes) {
    bits = (bits << 8) | byte;
    for (count += 8; count >= 5; count -= 5) {
      add((bits >> (count - 5)) & 31);
    }
    bits &= (1U << count) - 1;
  }
  if (count > 0) {
    add((bits << (5 - count)) & 31);
  }
  for (std::size_t i = 0; i < kChecksum; ++i) {
    checksum.add(0);
  }
  const std::uint32_t sum = checksum.value() ^ 1;
  for (std::size_t i = 0; i < kChecksum; ++i) {
    text += kLetters[(sum >> (5 * (kChecksum - 1 - i))) & 31];
  }
  return text;
}

bool read_bech32(std::string_view text, std::string_view prefix, std::span<std::uint8_t> bytes) {
  const std::size_t letters = (bytes.size() * 8 + 4) / 5;
  if (text.size() != prefix.size() + 1 + letters + kChecksum) {
    return false;
  }
  const auto is_upper = [](char c) { return c >= 'A' && c <= 'Z'; };
  const auto is_lower = [](char c) { return c >= 'a' && c <= 'z'; };
  if (std::any_of(text.begin(), text.end(), is_upper) &&
      std::any_of(text.begin(), text.end(), is_lower)) {
    return false;
  }
  const auto lower = [&](char c) { return is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c; };
  if (!std::equal(prefix.begin(), prefix.end(), text.begin(),
                  [&](char a, char b) { return a == lower(b); }) ||
      text[prefix.size()] != '1') {
    return false;
  }
  Checksum checksum(prefix);
  std::uint32_t bits = 0;
  int count = 0;
  std::size_t done = 0;
  const std::string_view data = text.substr(prefix.size() + 1);
  for (std::size_t i = 0; i < data.size(); ++i) {
    const std::size_t five_bits = kLetters.find(lower(data[i]));
    if (five_bits == std::string_view::npos) {
      return false;
    }
    checksum.add(static_cast<std::uint32_t>(five_bits));
    if (i >= letters) {
      continue;
    }
    bits = (bits << 5) | static_cast<std::uint32_t>(five_bits);
    count += 5;
    if (count >= 8) {
      count -= 8;
      bytes[done++] = static_cast<std::uint8_t>(bits >> count);
      bits &= (1U << count) - 1;
    }
  }
  return checksum.value() == 1 && done == bytes.size() && bits == 0;
}

}  // namespace atelier
