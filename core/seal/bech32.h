#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/seal/secret.h"

namespace atelier {

/// Bech32 of bytes (BIP 173, without its bound of 90 characters), in lower case: "age1...".
std::string bech32_text(std::string_view prefix, Bytes bytes);

/// Fills `bytes` with what a Bech32 text of that prefix says. False unless the text is all of one
/// case, its checksum is right, it says exactly so many bytes, and it is what `bech32_text` writes
/// of them. `prefix` is in lower case.
bool read_bech32(std::string_view text, std::string_view prefix, std::span<std::uint8_t> bytes);

}  // namespace atelier
