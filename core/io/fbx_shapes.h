#pragma once

// Behind fbx_import.h: what libassimp does not hand on of an FBX file's deformers. Only core/io
// includes this.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace atelier {

/// How blend shapes stood when a file was saved, and how its skins blend.
class FbxShapes {
 public:
  /// Reads the channels and skins of an FBX file, binary or text; nothing is thrown
  /// (fbx_records.h).
  explicit FbxShapes(std::span<const std::byte> bytes);

  /// The weight at which a shape is added to its mesh: of one of several shapes of a channel, its
  /// part (ufbx' interpolation between the weights at which they are whole). 0 for a name that is
  /// not there, NaN where shapes of one name stand at different weights.
  /// @param name  as libassimp calls it: of the channel or of the shape
  /// @param turn  how many shapes of the mesh had the name before
  double weight(const std::string& name, std::size_t turn) const;

  /// A skin that is blended by dual quaternions, everywhere or by weights of its own.
  bool dual_quaternions() const { return dual_quaternions_; }

  /// A skin that may be, by compressed weights of its own, which are not read: of 3ds Max, which
  /// writes weights of 0 for linear skins, hardly ever.
  bool unread_weights() const { return unread_weights_; }

 private:
  void add(const std::string& name, const std::vector<double>& weights);

  std::map<std::string, std::vector<double>> weights_;
  bool dual_quaternions_ = false;
  bool unread_weights_ = false;
};

/// The parts of shapes in a channel at `value`.
/// @param whole  value at which each shape is whole, in any order; [n]
/// Returns [n]: linear between the shapes on either side and beyond the outermost, with the mesh
/// itself at 0.
std::vector<double> fbx_shape_parts(double value, const std::vector<double>& whole);

}  // namespace atelier
