#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace atelier {

/// The bytes that an LZ4 block (lz4_Block_format.md of the LZ4 project) holds. Throws DataError
/// (`file`, `place`) for one that is damaged or holds more than `most` bytes.
std::vector<std::byte> lz4_block(std::span<const std::byte> block, std::size_t most,
                                 const std::string& file, const std::string& place);

}  // namespace atelier
