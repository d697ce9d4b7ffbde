#pragma once

// Behind fbx_import.h: one mesh of a scene that libassimp has read. Only core/io includes this.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/io/mesh_gltf.h"

struct aiMesh;

namespace atelier {

/// A mesh as a primitive, and what it leaves out.
struct FbxPrimitive {
  GltfPrimitive primitive;                ///< targets: one for each of `target_names`
  std::vector<std::string> target_names;  ///< unique
  std::vector<std::string> given_names;   ///< the same as libassimp has them
  Index left_out = 0;                     ///< points, lines and triangles that are none
};

/// @param scene_from_mesh  applied to positions, normals and blend shapes
/// @param joint_of_bone    [bones of the mesh] what GltfPrimitive::joints holds; empty: no weights
/// @param name             file, for errors
/// Corners that agree in all that is kept become one vertex. A skinned mesh keeps no normals, which
/// belong to its rest pose. Throws DataError for numbers that are not finite, negative weights and
/// vertices that are not there.
FbxPrimitive fbx_primitive(const aiMesh& mesh, const Eigen::Matrix4d& scene_from_mesh,
                           const std::vector<int>& joint_of_bone, const std::string& name);

}  // namespace atelier
