#include "core/mark/cyclic_checksum.h"

#include <array>

namespace atelier {

std::uint32_t cyclic_checksum(std::string_view bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> values{};
    for (std::uint32_t i = 0; i < values.size(); ++i) {
      std::uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) {
        value = value >> 1 ^ ((value & 1) != 0 ? 0xEDB88320u : 0u);
      }
      values[i] = value;
    }
    return values;
  }();
  std::uint32_t sum = 0xFFFFFFFFu;
  for (const char byte : bytes) {
    sum = sum >> 8 ^ table[(sum ^ static_cast<std::uint8_t>(byte)) & 0xFF];
  }
  return ~sum;
}

}  // namespace atelier
