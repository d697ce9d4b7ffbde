#pragma once

#include <cstdint>
#include <string_view>

namespace atelier {

/// CRC-32 (IEEE 802.3), as PNG has it: of no bytes 0, of zeros not 0.
std::uint32_t cyclic_checksum(std::string_view bytes);

}  // namespace atelier
