#pragma once

// The bytes behind mesh_gltf.h: the GLB container, buffers, views, accessors. Only core/io includes
// this.

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/json_place.h"
#include "core/limits.h"

namespace atelier {

/// The two chunks of a GLB file, or the text of a .gltf file.
struct GltfChunks {
  std::string_view json;
  std::optional<std::span<const std::byte>> binary;
};

/// Throws DataError if bytes that begin with "glTF" are no whole GLB 2 file.
GltfChunks split_glb(std::span<const std::byte> bytes, const std::string& name);

/// Bytes of "data:...;base64,...". Throws DataError at `uri`.
std::vector<std::byte> decode_data_uri(const JsonPlace& uri);

/// The file that a relative URI names below `folder`. Throws DataError at `uri` if it could lead
/// anywhere else.
std::filesystem::path file_below(const std::filesystem::path& folder, const JsonPlace& uri);

/// Buffers, buffer views and accessors of one document.
class GltfBuffers {
 public:
  /// @param folder  where external buffers are; none: they are refused
  GltfBuffers(const JsonPlace& root, const std::optional<std::span<const std::byte>>& binary,
              const std::optional<std::filesystem::path>& folder, const Limits& limits);

  /// The accessor that `place` is the index of, as [count, components] (a matrix by its columns);
  /// normalized integers as fractions.
  /// Throws DataError unless its type is one of `types` and all numbers are finite.
  Eigen::MatrixXd read(const JsonPlace& place, std::initializer_list<std::string_view> types,
                       std::int64_t max_count);

  /// The same with numbers that are whole.
  Eigen::MatrixXi read_integers(const JsonPlace& place, std::string_view type,
                                std::int64_t max_count);

  /// Whether an accessor has numbers of its own: without a buffer it is zeros.
  bool has_numbers(const JsonPlace& place) const;

 private:
  struct View {
    std::span<const std::byte> bytes;
    std::size_t stride = 0;  ///< 0: packed
  };

  const JsonPlace& accessor(const JsonPlace& place) const;
  View view(const JsonPlace& index);
  std::span<const std::byte> stored_bytes(const JsonPlace& place) const;
  void fill_sparse(const JsonPlace& accessor, int component_type, bool normalized,
                   Eigen::MatrixXd& values);
  void pay(const JsonPlace& accessor, std::int64_t count, std::int64_t components);

  std::vector<std::vector<std::byte>> owned_;
  std::vector<std::span<const std::byte>> buffers_;
  std::vector<JsonPlace> views_;
  std::vector<std::optional<std::vector<std::byte>>> decoded_;  ///< [views] of compressed ones
  std::int64_t to_decode_ = 0;                                  ///< bytes that may still be decoded
  std::vector<JsonPlace> accessors_;
  std::int64_t budget_ = 0;  ///< numbers that may still be decoded
};

}  // namespace atelier
