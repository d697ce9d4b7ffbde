#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/archive.h"
#include "core/limits.h"

namespace atelier {

/// Where a dataset's bytes lie: slabs of `chunk_rows` rows of the first dimension, each at its own
/// offset in the file.
struct ArchivedDataset {
  std::string name;
  ElementType type = ElementType::Float64;
  std::size_t text_bytes = 0;  ///< Text: bytes of each string, padded with NUL
  std::vector<std::int64_t> shape;
  std::int64_t chunk_rows = 0;         ///< 0: no data
  std::vector<std::uint64_t> offsets;  ///< of each chunk, bytes from the file's beginning

  std::size_t item_bytes() const {
    return type == ElementType::Text ? text_bytes : element_bytes(type);
  }
};

/// The text in the user block of an archive (docs/reference/formats.md):
/// ~~~
///   ATELIER-ARCHIVE 1 <SHA-256 of all bytes after this line, 64 hexadecimal digits>
///   block <bytes of the user block>
///   size <bytes of the file>
///   schema <name> <version>
///   units <unit>
///   up <axis>
///   number <name> <value>                            any times, sorted by name
///   text <name> <value, percent-encoded>             any times, sorted by name
///   dataset <name> <type> <sizes> <rows of a chunk> <offset> ...    any times, sorted by name
///   end
/// ~~~
/// and zeros up to the end of the block.
struct ArchiveIndex {
  std::uint64_t block_bytes = 0;
  std::uint64_t file_bytes = 0;
  Archive head;  ///< without datasets
  std::vector<ArchivedDataset> datasets;
};

/// Length of the first line with its line end.
constexpr std::size_t kArchiveFirstLine = 18 + 64 + 1;
constexpr std::string_view kArchiveMagic = "ATELIER-ARCHIVE 1 ";
/// Enough to find `block` in.
constexpr std::size_t kArchivePrefix = 512;
constexpr std::uint64_t kArchiveBlockMax = 64ull << 20;

/// The lines after the first.
std::string archive_index_text(const ArchiveIndex& index);

/// Bytes of the user block, from its first 512.
std::uint64_t archive_block_bytes(std::string_view prefix, const std::string& file);

/// Reads the user block of a file of `file_bytes` and judges everything in it: names, types, shapes
/// and limits, chunks inside the file and apart from each other.
ArchiveIndex parse_archive_index(std::string_view block, std::uint64_t file_bytes,
                                 const std::string& file, const Limits& limits);

/// True for the types that archives hold: bool, integers, float32, float64 and Text.
bool is_archive_type(ElementType type);

/// True for names that archives may use. @param slashes  whether "/" separates groups
bool is_archive_name(std::string_view name, bool slashes);

}  // namespace atelier
