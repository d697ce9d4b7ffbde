#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/limits.h"

namespace atelier {

/// A zip (also zip64) of stored or deflated members, read member by member. Opening reads the list
/// of members. Names of members are only compared, never used as paths.
///
/// DataError, with file and member, for: anything that is no such zip, more members than
/// `limits.archive_entries`, two members of one name, encryption, other compression methods,
/// members that claim more than `limits.inflate_ratio` bytes per stored byte (above
/// `limits.inflate_free_bytes`) or more than they may, wrong checksums.
class ZipArchive {
 public:
  explicit ZipArchive(const std::filesystem::path& path, const Limits& limits = {});
  /// From memory. @param name  for errors
  ZipArchive(std::vector<std::byte> bytes, std::string name, const Limits& limits = {});
  ~ZipArchive();
  ZipArchive(ZipArchive&&) noexcept;
  ZipArchive& operator=(ZipArchive&&) noexcept;

  /// In the order of the file; folders (names that end in '/') are members of no bytes.
  const std::vector<std::string>& names() const;
  bool contains(std::string_view name) const;
  /// Those that unpacking makes symbolic links of, whose content is where they lead.
  std::vector<std::string> symbolic_links() const;
  const std::string& file() const;

  /// One member, inflated; DataError if there is none of that name or it has more than `max_bytes`.
  /// Not for several threads at once.
  std::vector<std::byte> read(std::string_view name, std::int64_t max_bytes) const;

  /// Inflates every member without keeping it; DataError for the first that is damaged, or where
  /// all of them have more than `limits.inflate_ratio` bytes per byte of the file (above
  /// `limits.inflate_free_bytes`). Not for several threads at once.
  void check() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The bytes of a zip of these members, in this order, dated 1980-01-01: the same members give the
/// same bytes. Everything is in memory at once.
/// @param deflate  compress the members
std::vector<std::byte> zip_bytes(
    const std::vector<std::pair<std::string, std::vector<std::byte>>>& members, bool deflate);

}  // namespace atelier
