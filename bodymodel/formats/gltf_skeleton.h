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
  std::vector<Finding> findings;
};

/// Throws as read_gltf_body says.
GltfSkeleton gltf_skeleton(const GltfScene& scene, int skin, const std::string& file);

}  // namespace atelier
