#include "core/archive.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <functional>

#include <unistd.h>

#include "core/archive_index.h"
#include "core/error.h"
#include "core/regular_file.h"
#include "core/sha256.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";

/// The bytes of an archive, in a file or in memory. `read` fills `target` from `offset`; both lie
/// inside `size`.
struct Source {
  std::uint64_t size = 0;
  std::function<void(std::uint64_t offset, std::span<std::byte> target)> read;
};

Source source_of(const RegularFile& file, const std::filesystem::path& path) {
  return {static_cast<std::uint64_t>(file.size()),
          [&file, path](std::uint64_t offset, std::span<std::byte> target) {
            while (!target.empty()) {
              const ssize_t count = pread(file.descriptor(), target.data(), target.size(),
                                          static_cast<off_t>(offset));
              if (count < 0 && errno == EINTR) {
                continue;
              }
              if (count < 0) {
                throw EnvironmentError(path.string(), "cannot read: " + system_reason(errno));
              }
              if (count == 0) {
                throw DataError(path.string(), "byte " + std::to_string(offset),
                                "the file became shorter while it was read", "a quiet file");
              }
              offset += static_cast<std::uint64_t>(count);
              target = target.subspan(static_cast<std::size_t>(count));
            }
          }};
}

std::string text_at(const Source& source, std::uint64_t size) {
  std::string text(static_cast<std::size_t>(size), '\0');
  source.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

ArchiveIndex index_of(const Source& source, const std::string& file, const Limits& limits) {
  const std::uint64_t block = archive_block_bytes(
      text_at(source, std::min<std::uint64_t>(source.size, kArchivePrefix)), file);
  if (source.size < block + kSignature.size()) {
    throw DataError(file, "byte " + std::to_string(source.size), "the file ends",
                    "a user block of " + std::to_string(block) + " bytes and HDF5 after it");
  }
  return parse_archive_index(text_at(source, block), source.size, file, limits);
}

void check_digest(const Source& source, const std::string& file) {
  const std::string first = text_at(source, kArchiveFirstLine);
  Sha256 hash;
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;
  std::vector<std::byte> buffer(static_cast<std::size_t>(std::min(kPart, source.size)));
  for (std::uint64_t at = kArchiveFirstLine; at < source.size;) {
    const auto part = std::span(buffer).first(
        static_cast<std::size_t>(std::min<std::uint64_t>(buffer.size(), source.size - at)));
    source.read(at, part);
    hash.update(part.data(), part.size());
    at += part.size();
  }
  if (hex(hash.finish()) != first.substr(kArchiveMagic.size(), 64)) {
    throw DataError(file, "", "the SHA-256 of the content is not the one in the file",
                    "an undamaged archive; write it again");
  }
}

Tensor dataset_of(const Source& source, const ArchivedDataset& entry, const std::string& file) {
  Tensor tensor{entry.type, entry.shape, {}, {}};
  std::size_t row_bytes = entry.item_bytes();
  for (std::size_t d = 1; d < entry.shape.size(); ++d) {
    row_bytes *= static_cast<std::size_t>(entry.shape[d]);
  }
  std::vector<std::byte> data(
      entry.offsets.empty() ? 0 : row_bytes * static_cast<std::size_t>(entry.shape[0]));
  const std::size_t chunk_bytes = row_bytes * static_cast<std::size_t>(entry.chunk_rows);
  for (std::size_t i = 0; i < entry.offsets.size(); ++i) {
    const std::size_t begin = i * chunk_bytes;
    source.read(entry.offsets[i],
                std::span(data).subspan(begin, std::min(chunk_bytes, data.size() - begin)));
  }
  if (entry.type == ElementType::Bool &&
      std::any_of(data.begin(), data.end(), [](std::byte b) { return b > std::byte{1}; })) {
    throw DataError(file, "dataset " + entry.name, "a bool that is neither 0 nor 1", "0 or 1");
  }
  if (entry.type != ElementType::Text) {
    tensor.data = std::move(data);
    return tensor;
  }
  for (std::size_t at = 0; at < data.size(); at += entry.text_bytes) {
    const char* begin = reinterpret_cast<const char*>(data.data()) + at;
    tensor.strings.emplace_back(begin, strnlen(begin, entry.text_bytes));
  }
  return tensor;
}

Archive read_from(const Source& source, const std::string& schema, int newest_version,
                  const std::string& file, const Limits& limits) {
  const ArchiveIndex index = index_of(source, file, limits);
  check_digest(source, file);
  if (index.head.schema != schema) {
    throw DataError(file, "schema", index.head.schema, schema);
  }
  if (index.head.version < 1 || index.head.version > newest_version) {
    throw DataError(file, "schema", schema + " version " + std::to_string(index.head.version),
                    "1 to " + std::to_string(newest_version) + "; a newer program wrote it");
  }
  std::string signature(kSignature.size(), '\0');
  source.read(index.block_bytes, std::as_writable_bytes(std::span(signature)));
  if (signature != kSignature) {
    throw DataError(file, "byte " + std::to_string(index.block_bytes), "no HDF5", "HDF5");
  }
  Archive archive = index.head;
  for (const ArchivedDataset& entry : index.datasets) {
    archive.datasets.emplace(entry.name, dataset_of(source, entry, file));
  }
  return archive;
}

}  // namespace

Archive read_archive(const std::filesystem::path& path, const std::string& schema,
                     int newest_version, const Limits& limits) {
  const RegularFile file(path);
  file.check_size(limits.tensor_bytes, path);
  return read_from(source_of(file, path), schema, newest_version, path.string(), limits);
}

Archive parse_archive(std::span<const std::byte> bytes, const std::string& schema,
                      int newest_version, const std::string& file, const Limits& limits) {
  const Source source{bytes.size(), [bytes](std::uint64_t offset, std::span<std::byte> target) {
                        std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset),
                                    target.size(), target.begin());
                      }};
  return read_from(source, schema, newest_version, file, limits);
}

Archive archive_contents(const std::filesystem::path& path, const Limits& limits) {
  const RegularFile file(path);
  file.check_size(limits.tensor_bytes, path);
  ArchiveIndex index = index_of(source_of(file, path), path.string(), limits);
  for (const ArchivedDataset& entry : index.datasets) {
    index.head.datasets.emplace(entry.name, Tensor{entry.type, entry.shape, {}, {}});
  }
  return index.head;
}

}  // namespace atelier
