#pragma once

// Behind fbx_import.h: what libassimp reads of an FBX file's nodes and clusters and does not hand
// on. Only core/io includes this.

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/types.h"

namespace atelier {

/// How a cluster was bound.
struct FbxBind {
  Eigen::Matrix4d joint_from_mesh;   ///< "Transform": what libassimp calls the offset matrix
  Eigen::Matrix4d world_from_joint;  ///< "TransformLink"
};

/// The bind matrices of all clusters of an FBX file, binary or text; those whose matrices are
/// compressed or not of 16 numbers are left out, and nothing is thrown (fbx_records.h).
std::vector<FbxBind> fbx_binds(std::span<const std::byte> bytes);

/// How the scales above a node come to it: FBX's InheritType.
enum class FbxInherit {
  Whole,        ///< RSrs: as matrices are multiplied, which is all that libassimp has
  ByAxis,       ///< RrSs: scales are multiplied axis by axis, after all rotations
  NotOfParent,  ///< Rrs: so, and without the parent's own: Maya's segment scale compensation
};

/// What a node says of itself and libassimp gets wrong: where its mesh, and not its children,
/// stands (3ds Max writes that of moved pivots), the turn that its rotation is followed by
/// inversely, and how it takes the scales above it.
struct FbxModel {
  std::string name;
  Eigen::Vector3d geometric_translation = Eigen::Vector3d::Zero();
  Eigen::Vector3d geometric_rotation = Eigen::Vector3d::Zero();  ///< degrees, x first
  Eigen::Vector3d geometric_scaling = Eigen::Vector3d::Ones();
  Eigen::Vector3d post_rotation = Eigen::Vector3d::Zero();  ///< degrees, x first
  int rotation_order = 0;  ///< 0 to 5: XYZ, XZY, YZX, YXZ, ZXY, ZYX, the first axis first
  bool pivots = false;     ///< RotationPivot, RotationOffset, ScalingPivot or ScalingOffset
  FbxInherit inherits = FbxInherit::Whole;  ///< where no node and no template says: whole

  bool has_geometric() const {
    return !geometric_translation.isZero(0) || !geometric_rotation.isZero(0) ||
           geometric_scaling != Eigen::Vector3d::Ones();
  }
  bool has_places() const { return has_geometric() || !post_rotation.isZero(0); }
};

/// All nodes, in the order of the file; as fbx_binds nothing is thrown.
std::vector<FbxModel> fbx_models(std::span<const std::byte> bytes);

}  // namespace atelier
