#pragma once

// Behind fbx_import.h: what libassimp reads of an FBX file and does not hand on. Only core/io
// includes this.

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace atelier {

/// How a cluster was bound.
struct FbxBind {
  Eigen::Matrix4d joint_from_mesh;   ///< "Transform": what libassimp calls the offset matrix
  Eigen::Matrix4d world_from_joint;  ///< "TransformLink"
};

/// The bind matrices of all clusters of an FBX file, binary or text; those whose matrices are
/// compressed or not of 16 numbers are left out, and nothing is thrown: libassimp has said before
/// whether a file is sound. O(bytes of text, records of binary).
std::vector<FbxBind> fbx_binds(std::span<const std::byte> bytes);

}  // namespace atelier
