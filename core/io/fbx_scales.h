#pragma once

// Behind fbx_import.h: scales that nodes of an FBX file do not inherit as matrices are multiplied.
// Only core/io includes this.

#include <Eigen/Core>
#include <vector>

#include "core/io/fbx_binds.h"
#include "core/io/mesh_gltf.h"

namespace atelier {

/// A node's part in its chain of scales. With rotation R its transform's linear part is
/// diag(undone) R diag(applied), as Autodesk's FBX SDK and ufbx have InheritType.
struct FbxScale {
  Eigen::Vector3d undone = Eigen::Vector3d::Ones();   ///< of the parent's scales, before R
  Eigen::Vector3d taken = Eigen::Vector3d::Ones();    ///< over from above
  Eigen::Vector3d applied = Eigen::Vector3d::Ones();  ///< the node's own by those taken over
  int parent = -1;
  int from = -1;       ///< the node above it whose `applied` is taken over, or none
  bool apart = false;  ///< it says otherwise than as matrices are multiplied

  /// One factor on all axes is undone: the same before a rotation and after it.
  bool even() const { return undone.isConstant(undone[0], 1e-5); }
  /// Nothing is scaled otherwise than by matrices.
  bool trivial() const { return undone.isOnes() && taken.isOnes(); }
};

/// Effect of an animation on the scale of a node.
enum class FbxScaleChange : char { None, Even, Uneven };

/// @param nodes     parents first; node 0 is no node of the file and scales nothing that is undone
/// @param inherits  [N]
std::vector<FbxScale> fbx_scales(const std::vector<GltfNode>& nodes,
                                 const std::vector<FbxInherit>& inherits);

/// The first node that translations, rotations and scales over time cannot move: the scale that it
/// undoes changes, or differs by axis while it moves. -1 if there is none.
/// @param changes  [N]
/// @param moved    [N] whether the animation has keys of the node
int unscalable_node(const std::vector<FbxScale>& scales, std::vector<FbxScaleChange> changes,
                    const std::vector<char>& moved);

}  // namespace atelier
