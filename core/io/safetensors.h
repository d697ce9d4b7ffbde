#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// Named tensors with texts about them: networks, optimiser states.
struct Safetensors {
  std::map<std::string, Tensor> tensors;
  std::map<std::string, std::string> metadata;
};

/// Reads the safetensors format (huggingface/safetensors: 8 bytes of header length, JSON header,
/// tensors): bool, integers, float16, bfloat16, float32, float64. Elements that are not finite are
/// read; check_finite judges.
///
/// DataError, with the tensor's name, unless the header is at most
/// `limits.safetensors_header_bytes` long with at most `limits.safetensors_entries` tensors, holds
/// nothing but dtype, shape, data_offsets and texts, every tensor has exactly the bytes of its
/// shape, and the tensors, sorted by offset, fill the rest of the file without gap and overlap. So
/// no file takes more memory than it has bytes, and no two readers see different contents.
Safetensors parse_safetensors(std::span<const std::byte> bytes, const std::string& file = "",
                              const Limits& limits = {});

/// Reads a file.
Safetensors read_safetensors(const std::filesystem::path& path, const Limits& limits = {});

/// The bytes of a file, larger elements first, so that every tensor is aligned; the same content
/// gives the same bytes. Text and complex tensors are LogicError, also what parse_safetensors would
/// refuse: too many tensors, a tensor named "__metadata__".
std::vector<std::byte> safetensors_bytes(const Safetensors& content);

/// Writes a file through AtomicFile.
void write_safetensors(const std::filesystem::path& path, const Safetensors& content);

}  // namespace atelier
