#pragma once

// Behind fbx_import.h: what libassimp reads of an FBX file and does not hand on. Only core/io
// includes this.

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
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

/// What a node says of itself and libassimp gets wrong: where its mesh, and not its children,
/// stands (3ds Max writes that of moved pivots), and the turn that its rotation is followed by
/// inversely.
struct FbxModel {
  std::string name;
  Eigen::Vector3d geometric_translation = Eigen::Vector3d::Zero();
  Eigen::Vector3d geometric_rotation = Eigen::Vector3d::Zero();  ///< degrees, x first
  Eigen::Vector3d geometric_scaling = Eigen::Vector3d::Ones();
  Eigen::Vector3d post_rotation = Eigen::Vector3d::Zero();  ///< degrees, x first
  int rotation_order = 0;  ///< 0 to 5: XYZ, XZY, YZX, YXZ, ZXY, ZYX, the first axis first
  bool pivots = false;     ///< RotationPivot, RotationOffset, ScalingPivot or ScalingOffset

  bool has_geometric() const {
    return !geometric_translation.isZero(0) || !geometric_rotation.isZero(0) ||
           geometric_scaling != Eigen::Vector3d::Ones();
  }
};

/// The nodes that say any of that, in the order of the file; as fbx_binds nothing is thrown.
std::vector<FbxModel> fbx_models(std::span<const std::byte> bytes);

}  // namespace atelier
