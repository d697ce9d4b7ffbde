#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"
#include "core/tensor.h"

namespace atelier {

/// A NumPy npz file: a zip (also zip64) of npy members, stored or deflated. Opening reads the list
/// of members; each member is read when asked for.
///
/// DataError, with file and member, for: anything that is no such zip, more members than
/// `limits.archive_entries`, two members of one name, encryption, other compression methods,
/// members that claim more than `limits.inflate_ratio` bytes per stored byte (above
/// `limits.inflate_free_bytes`) or more than `limits.tensor_bytes`, wrong checksums, and whatever
/// parse_npy refuses. Names of members are only compared, never used as paths.
class Npz {
 public:
  /// Opens a file.
  explicit Npz(const std::filesystem::path& path, const Limits& limits = {});
  /// Opens a file in memory. @param name  for errors
  Npz(std::vector<std::byte> bytes, std::string name, const Limits& limits = {});
  ~Npz();
  Npz(Npz&&) noexcept;
  Npz& operator=(Npz&&) noexcept;

  /// Names of the arrays in the order of the file, without ".npy".
  const std::vector<std::string>& names() const;
  bool contains(std::string_view name) const;
  const std::string& file() const;

  /// Reads one array; DataError if there is none of that name. Not for several threads at once.
  Tensor read(std::string_view name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The bytes of an npz of these arrays, sorted by name; the same arrays give the same bytes.
/// @param deflate  compress the members
std::vector<std::byte> npz_bytes(const std::map<std::string, Tensor>& arrays, bool deflate = true);

/// Writes an npz through AtomicFile.
void write_npz(const std::filesystem::path& path, const std::map<std::string, Tensor>& arrays,
               bool deflate = true);

}  // namespace atelier
