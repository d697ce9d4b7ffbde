#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh.h"
#include "core/types.h"

namespace atelier {

/// Arrays and what is said of them, as one file of a page: a script that calls
/// `atelierData(key, header, text)`. A page that lies on a disk (file://) may load scripts and may
/// not fetch bytes, so that this one form serves a disk as well as a server. `text` is base64 of
/// the arrays, one behind the other, deflated.
class ViewData {
 public:
  nlohmann::ordered_json header = nlohmann::ordered_json::object();

  /// Adds an array of uint8, uint16, uint32 or float32, little-endian, at a multiple of 4 bytes.
  template <class T>
  void add(std::string_view name, std::span<const T> values) {
    add_bytes(name, type_of(T{}), values.size(), std::as_bytes(values));
  }

  /// The script. @param key  by which the page asks for it: the file's name without ".js"
  std::string script(const std::string& key) const;

 private:
  static std::string_view type_of(std::uint8_t /*value*/) { return "Uint8Array"; }
  static std::string_view type_of(std::uint16_t /*value*/) { return "Uint16Array"; }
  static std::string_view type_of(std::uint32_t /*value*/) { return "Uint32Array"; }
  static std::string_view type_of(float /*value*/) { return "Float32Array"; }
  void add_bytes(std::string_view name, std::string_view type, std::size_t count,
                 std::span<const std::byte> bytes);

  std::string bytes_;
};

/// Vertices of frames of one topology, each coordinate in 16 bits: `low + step * value`. A box of
/// 2 m has steps of 0.03 mm, and no coordinate is off by more than half of one.
struct QuantizedFrames {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  ///< m
  double step = 1;                                ///< m
  std::size_t frames = 0;
  std::vector<std::uint16_t> values;  ///< [frames,V,3]
};

/// Throws LogicError for frames of different numbers of vertices or with coordinates that are not
/// finite.
QuantizedFrames quantize(std::span<const Points> frames);

/// Adds the vertices as `low` and `step` of the header and the arrays "small" and "large" [N], the
/// lower and higher bytes of how much further each value moves from the frame before (in the first
/// frame from 0) than that of the vertex before, zigzag-coded: vertices beside each other move
/// alike, and "large" is nearly empty, which deflates well.
void add_vertices(ViewData& data, const QuantizedFrames& frames);

/// For each face the inverse of its two edges in its own plane, [F,4] row-major, 1/m: what a page
/// makes strain of. Zeros for a face without area.
std::vector<float> inverse_rest_edges(const Points& vertices, const Triangles& faces);

/// Numbers in [low, high] as 0 to 255; those outside are the ends.
std::vector<std::uint8_t> to_bytes(std::span<const double> values, double low, double high);

/// What is wrong with the data that `work` reads, as a page may say it: with the file's name,
/// without the folders that it lies in, which say who has it. None where nothing is. Other
/// exceptions pass.
std::optional<std::string> problem_of(const std::function<void()>& work);

/// A text as a page may say it: places below one of `roots` as they are named from there, and of
/// any other absolute place its last name alone, since folders say who has it. A place ends at a
/// blank, a quote, a bracket, a comma or a semicolon, unless it is below a root.
std::string without_folders(std::string text, std::span<const std::string> roots);

}  // namespace atelier
