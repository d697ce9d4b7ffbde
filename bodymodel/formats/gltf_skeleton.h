#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/finding.h"
#include "core/io/mesh_gltf.h"

namespace atelier {

/// The skeleton of a skin, parents first, in the scene's world at rest.
struct GltfSkeleton {
  Skeleton skeleton;
  std::vector<int> nodes;   ///< [J] node of each joint
  std::vector<int> number;  ///< [joints of the skin] joint of each of the skin's joints
  Eigen::Matrix4d world_from_mesh = Eigen::Matrix4d::Identity();  ///< of the bind pose
  /// World from each of the skin's joints, as the nodes stand, where the skin's bind matrices are
  /// missing or all the identity, so that they say no bind pose: `skeleton` is then that of the
  /// nodes. Else empty.
  std::vector<Eigen::Matrix4d> unbound;
  std::vector<Finding> findings;
};

/// Throws as read_gltf_body says.
GltfSkeleton gltf_skeleton(const GltfScene& scene, int skin, const std::string& file);

/// The skin of a scene without one: the nodes that an animation turns or shifts, those between
/// them, the nearest node above all of them, and those below without a mesh (ends of limbs), bound
/// as they stand; parents first. Where several people hang on a node that the animation leaves
/// alone, or on none, a skin for each, named as the topmost node is. Throws DataError where no node
/// is moved, or moved nodes hang on nothing in common and are not several people.
std::vector<GltfSkin> skins_of_animation(const GltfScene& scene, const GltfAnimation& animation,
                                         const std::string& file);

}  // namespace atelier
