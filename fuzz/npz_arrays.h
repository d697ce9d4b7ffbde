#pragma once

#include <cstddef>
#include <span>

#include "core/io/npz.h"
#include "core/io/safetensors.h"

namespace atelier::fuzz {

/// The arrays of a fuzzed file, for the readers that take an npz: an npz itself, or a safetensors
/// file whose tensors are put into one. An npz has checksums, behind which damage seldom comes as
/// far as the reader of the arrays; safetensors has none.
inline Npz npz_of(std::span<const std::byte> bytes, const char* name) {
  const bool zip = bytes.size() >= 2 && bytes[0] == std::byte{'P'} && bytes[1] == std::byte{'K'};
  if (zip) {
    return Npz({bytes.begin(), bytes.end()}, name);
  }
  return Npz(npz_bytes(parse_safetensors(bytes, name).tensors, false), name);
}

}  // namespace atelier::fuzz
