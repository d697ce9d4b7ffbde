#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/io/mesh_ply.h"

namespace atelier {

enum class PlyType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };

/// Bytes of one number in a binary file.
std::size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::Float32;  ///< of the number, or of a list's items
  bool is_list = false;
  PlyType count_type = PlyType::UInt8;  ///< of a list's length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// The header of a PLY file.
struct PlyHeader {
  PlyFormat format = PlyFormat::Ascii;
  std::vector<PlyElement> elements;
  MeshConvention convention;
  std::size_t bytes = 0;   ///< where the data begin
  std::int64_t lines = 0;  ///< of the header
};

/// Throws DataError with the line. At most 256 elements and 1024 properties; names are unique; an
/// element that has rows has properties.
PlyHeader read_ply_header(std::span<const std::byte> bytes, const std::string& name,
                          const Limits& limits);

}  // namespace atelier
