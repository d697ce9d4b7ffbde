#pragma once

#include <cstddef>
#include <span>

#include "core/error.h"
#include "core/io/npz.h"
#include "core/io/safetensors.h"
#include "core/utf8.h"

namespace atelier::fuzz {

/// The arrays of a fuzzed file, for the readers that take an npz: an npz itself, or a safetensors
/// file whose tensors are put into one. An npz has checksums, behind which damage seldom comes as
/// far as the reader of the arrays; safetensors has none. Names that no zip takes are DataError.
inline Npz npz_of(std::span<const std::byte> bytes, const char* name) {
  const bool zip = bytes.size() >= 2 && bytes[0] == std::byte{'P'} && bytes[1] == std::byte{'K'};
  if (zip) {
    return Npz({bytes.begin(), bytes.end()}, name);
  }
  const Safetensors file = parse_safetensors(bytes, name);
  for (const auto& [member, tensor] : file.tensors) {
    if (!is_printable_utf8(member)) {
      throw DataError(name, "header", "a name with control characters", "text");
    }
  }
  return Npz(npz_bytes(file.tensors, false), name);
}

}  // namespace atelier::fuzz
