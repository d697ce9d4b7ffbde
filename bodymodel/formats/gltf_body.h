#pragma once

#include <filesystem>
#include <string>

#include "bodymodel/body_model.h"
#include "bodymodel/motion_clip.h"
#include "core/io/mesh_gltf.h"
#include "core/limits.h"

namespace atelier {

/// Reads the skinned mesh of a scene as a body: all primitives of the first node that has mesh and
/// skin, in its bind pose, as large as the scene shows it. Joint rest frames are those of the
/// inverse bind matrices; joints of equal name get a number; weights are scaled to sum 1, morph
/// targets become shape parameters in [0,1], and vertices that were split along texture seams are
/// joined (body_seams.h). A skin without inverse bind matrices, or with none but the identity, is
/// bound as its nodes stand ("gltf-binds"). Other meshes with a skin are left out ("gltf-meshes").
/// Morph targets that the file shows at weights other than 0 are named ("gltf-weights").
/// From a path: glTF, or FBX (core/io/mesh_fbx.h). `findings` says what was repaired. Throws
/// DataError for a scene without a skin, a skin blended by dual quaternions (FBX), two roots,
/// joints that hang on one another in a cycle, bind matrices that shear or are scaled unevenly, and
/// what check_body_model refuses.
struct GltfBody {
  BodyModel model;
  std::vector<Finding> findings;
};
GltfBody read_gltf_body(const GltfScene& scene, const std::string& file = "");
GltfBody read_gltf_body(const std::filesystem::path& path, const Limits& limits = {});

/// Samples an animation of a scene (glTF or, from a path, FBX) at `options.fps`, if 0 at the rate
/// of its keys where these are even (30 where they are not), on the skeleton of the skin that it
/// moves (gltf_people.h; `options.skin` takes another) or, in a scene without skins, of the nodes
/// that it moves (gltf_skeleton.h). `options.animation` is a
/// name or a number from 1; without it the first animation that moves a joint is taken, and where
/// there are others they are named ("motion-animations"). Step, linear (rotations the short way)
/// and cubic spline keys. A skeleton has fixed bones: what animated translations and scales move
/// them is dropped with a finding ("motion-stretch"), but for the joint that both legs hang on,
/// which goes where it and the joints above it take it (path_joint.h). Throws DataError for a scene
/// without animations, one that moves no joint, and an animation that is not there.
MotionClip read_gltf_motion(const GltfScene& scene, const std::string& file = "",
                            const MotionOptions& options = {}, const Limits& limits = {});
MotionClip read_gltf_motion(const std::filesystem::path& path, const MotionOptions& options = {},
                            const Limits& limits = {});

/// A body at a shape as a glTF scene: mesh with normals, skin, a node for each joint and, if
/// `motion` has poses, an animation with linear keys. Pose correctives have no place in glTF and
/// are left out; so are shape parameters, whose joints no morph target moves. The four largest
/// influences of a vertex are kept, scaled to sum 1, since few programs show more. Throws
/// LogicError for poses of another skeleton.
GltfScene gltf_body(const BodyModel& model, const Eigen::VectorXd& shape = {},
                    const Motion& motion = {});

/// A motion without a body as a glTF scene: a node for each joint, a skin that names them (so that
/// readers know the rest pose), an animation with linear keys. End sites have no place in it.
/// Throws DataError for what check_motion_clip refuses.
GltfScene gltf_motion(const MotionClip& clip);

/// Vertices that a mesh has in glTF, which has one texture coordinate a vertex: those on seams
/// count for each.
Index gltf_vertex_count(const Mesh& mesh);

}  // namespace atelier
