#pragma once

// Compressed buffer views behind mesh_gltf.h. Only core/io includes this.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/io/json_place.h"

namespace atelier {

/// The bytes of a buffer view that EXT_meshopt_compression compresses (Khronos registry, 2022,
/// appendices A and B; also KHR_meshopt_compression with the same bitstreams): attributes (version
/// 0), triangles (0 and 1) and index sequences (0 and 1), and the filters octahedral, quaternion
/// and exponential. gltfpack and glTF-Transform write them.
/// @param view    the extension: count, byteStride, mode, filter
/// @param source  its bytes
/// @param most    bytes that may come out
/// Throws DataError at `view` for a mode, filter, stride or version that there is not, data that
/// end early or late, and more bytes than `most` or than the source can hold.
std::vector<std::byte> decode_meshopt(const JsonPlace& view, std::span<const std::byte> source,
                                      std::int64_t most);

}  // namespace atelier
