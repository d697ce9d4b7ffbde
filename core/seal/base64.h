#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/seal/secret.h"

namespace atelier {

/// Base64 with the standard letters (RFC 4648, section 4); age leaves the padding out, minisign
/// writes it.
enum class Base64 { Padded, Unpadded };

std::string base64_text(Bytes bytes, Base64 kind);

/// The bytes of a text; nothing unless it is exactly what `base64_text` writes of them.
std::optional<std::vector<std::uint8_t>> base64_bytes(std::string_view text, Base64 kind);

}  // namespace atelier
