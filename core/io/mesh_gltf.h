#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/limits.h"
#include "core/mesh.h"

namespace atelier {

/// Displacements that a weight adds to a primitive.
struct GltfMorphTarget {
  Points positions;  ///< [V,3] metres, or empty
  Points normals;    ///< [V,3] or empty
};

/// Triangles of one material. Vertices are split along seams, as glTF has them: uv_faces == faces.
struct GltfPrimitive {
  Mesh mesh;                ///< metres, in the frame of the node (of the skin, where there is one)
  Eigen::MatrixXi joints;   ///< [V, 4n] into GltfSkin::joints, or empty
  Eigen::MatrixXd weights;  ///< [V, 4n] not negative, as in the file, or empty
  std::vector<GltfMorphTarget> targets;  ///< as many in each primitive of a mesh
  std::string material;                  ///< name, "" if none
};

/// How the triangles of a material look. Written, not read.
struct GltfMaterial {
  std::string name;
  Eigen::Vector3d color =
      Eigen::Vector3d::Ones();     ///< base colour, linear, a factor of the texture
  std::vector<std::byte> texture;  ///< of the base colour, a PNG file; or empty
};

struct GltfMesh {
  std::string name;
  std::vector<GltfPrimitive> primitives;
  std::vector<double> weights;            ///< of the targets at rest, or empty: zero
  std::vector<std::string> target_names;  ///< or empty
};

/// A place in the tree.
struct GltfNode {
  std::string name;
  int parent = -1;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< metres
  Eigen::Vector4d rotation = Eigen::Vector4d(0, 0, 0, 1);  ///< unit quaternion x y z w
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  std::optional<Eigen::Matrix4d> matrix;  ///< instead of the three above
  int mesh = -1;                          ///< into GltfScene::meshes
  int skin = -1;                          ///< into GltfScene::skins
  std::vector<double> weights;            ///< of the mesh's targets, instead of its own; or empty
};

struct GltfSkin {
  std::string name;
  std::vector<int> joints;                     ///< nodes
  std::vector<Eigen::Matrix4d> inverse_binds;  ///< joint from mesh; as many as joints
  /// Blended by dual quaternions (Kavan et al., "Geometric skinning with approximate dual
  /// quaternion blending", 2008), which FBX has and glTF has not. Neither written nor read.
  bool dual_quaternions = false;
};

enum class GltfPath { Translation, Rotation, Scale, Weights };
enum class GltfInterpolation { Step, Linear, CubicSpline };

/// One property of a node over time.
struct GltfChannel {
  int node = -1;
  GltfPath path = GltfPath::Rotation;
  GltfInterpolation interpolation = GltfInterpolation::Linear;
  std::vector<double> times;  ///< [K] seconds, increasing
  /// [K, 3, 4 (x y z w) or number of weights]; CubicSpline: [3K, ...], in-tangent, value and
  /// out-tangent of each key
  Eigen::MatrixXd values;
};

struct GltfAnimation {
  std::string name;
  std::vector<GltfChannel> channels;
};

/// A glTF 2.0 file as plain data. Metres, right-handed, Y up, as glTF has it. Cameras, lights,
/// textures and, of what is read, materials but their names are left out; images are not decoded.
struct GltfScene {
  std::vector<GltfNode> nodes;  ///< a forest; children may stand before their parents
  std::vector<int> roots;       ///< nodes of the default scene; if there is no scene, all roots
  std::vector<GltfMesh> meshes;
  std::vector<GltfMaterial> materials;  ///< of those that primitives name; others are white
  std::vector<GltfSkin> skins;
  std::vector<GltfAnimation> animations;
  /// Whom it shows and what for, "" where nobody says: asset.extras.consent, and behind "Consent: "
  /// in asset.copyright.
  std::string consent;
  std::string copyright;  ///< asset.copyright, without what is written of `consent`; "": none
  std::vector<Finding> findings;  ///< what was skipped; of one that was made: what is not exact
};

/// Reads glTF 2.0, .gltf or .glb (told apart by the first bytes). All component types, normalized
/// integers, sparse accessors, strips and fans, data URIs, any number of JOINTS_n. Points and lines
/// are skipped with a finding, and so are meshes that KHR_node_visibility hides and what
/// EXT_mesh_gpu_instancing repeats. KHR_mesh_quantization, EXT_meshopt_compression and extensions
/// that only change the looks may be required; any other required extension is refused by its name.
///
/// From memory no other file is opened. From a path, buffers are read from files below its folder:
/// no scheme, no absolute path, no "..", no link that leads out.
///
/// We parse the JSON with our own strict parser and read accessors with every count paid for by
/// the bytes of its buffer view; see docs/decisions/0003-gltf-reader.md for why not by tinygltf.
/// Throws DataError that names the field: "accessors[3].count".
GltfScene read_gltf(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits = {});
GltfScene read_gltf(const std::filesystem::path& path, const Limits& limits = {});

/// Throws LogicError unless indices are in range, the nodes are a forest, and sizes agree.
void check_gltf(const GltfScene& scene);

/// The node's transform: parent from node.
Eigen::Matrix4d parent_from_node(const GltfNode& node);

/// World from node, for all nodes. Throws as `check_gltf`.
std::vector<Eigen::Matrix4d> world_from_nodes(const GltfScene& scene);

/// Whether a skin's bind matrices, missing or all the identity, say nothing of a bind pose although
/// its joints stand apart in `world`, [nodes].
bool says_no_bind_pose(const GltfSkin& skin, const std::vector<Eigen::Matrix4d>& world);

/// Where the mesh of such a skin stands, whose joints are at `joints`, world from each: true if in
/// the frames of its joints, which then move it to its place, as the standard has it; false if
/// where it is seen, the matrices forgotten. Vertices are near their joints in one of the two.
bool stands_in_joint_frames(const GltfMesh& mesh, const std::vector<Eigen::Matrix4d>& joints);

/// "gltf-binds" of each mesh that forgotten bind matrices tear in every viewer and in rest_mesh.
std::vector<Finding> torn_mesh_findings(const GltfScene& scene, const std::string& file);

/// The scene at rest, as a viewer shows it: every mesh below the roots with its morph weights, its
/// skin (linear blend, weights normalised) or its node's transform applied, as one mesh. An
/// attribute that only some primitives have is dropped. Throws DataError (with `file`) if there is
/// no triangle, if a skin of dual quaternions stands out of its bind pose, or if the mesh would
/// exceed the limits (vertices, faces, coordinates) or is not finite.
Mesh rest_mesh(const GltfScene& scene, const std::string& file = "", const Limits& limits = {});

/// One mesh, one node.
GltfScene gltf_scene(const Mesh& mesh, const std::string& name = "mesh");

/// Frames of a surface as sums of morph targets, on top of the first frame.
struct GltfMorphs {
  std::vector<GltfMorphTarget> targets;
  std::vector<std::string> names;  ///< of the targets
  Eigen::MatrixXd weights;         ///< [F,T], within -1 to 1; of the first frame zero
  double error = 0;                ///< m, by which a vertex is off at most; 0: each frame is kept
};

/// Morph targets a program plays without slowing down; our choice.
inline constexpr int kMostMorphTargets = 60;

/// One target a frame beside the first, where these are at most `most_targets`; else so many
/// principal components of the frames (Alexa and Müller, "Representing animations by principal
/// components", Eurographics 2000) as bring every vertex within 0.1 mm, at most `most_targets`.
/// @param positions  [F] of [V,3] metres
/// @param normals    the same, or empty; their targets are those of the same weights
GltfMorphs gltf_morphs(const std::vector<Points>& positions, const std::vector<Points>& normals,
                       int most_targets = kMostMorphTargets);

/// Gives the mesh of a node these targets, and the scene's first animation (a new one where there
/// is none) a channel of their weights, linear in between. The Note "gltf-shapes" says how far off
/// frames are. Throws LogicError as check_gltf, when written.
void add_gltf_morphs(GltfScene& scene, int node, GltfMorphs morphs, double fps);

/// A sequence over one topology by morph targets (gltf_morphs), with normals: the only way to carry
/// cloth that no skeleton moves. Throws LogicError if there is no frame, fps is not positive, or
/// the frames have different topology.
GltfScene gltf_morph_sequence(const std::vector<Mesh>& frames, double fps,
                              const std::string& name = "sequence");

/// Gives nodes the transforms and weights of the first keys of the first animation: that is what
/// programs show which play none. Throws as `check_gltf`.
void show_first_keys(GltfScene& scene);

/// A .glb file. Positions, normals and uvs are stored as float, colours as float, joints as bytes
/// or shorts; vertices are split where one has several texture coordinates. Materials are no metal
/// (glTF's default is) and seen from both sides, those of primitives that name none, too. Labels
/// and confidence have no place in glTF. Throws as `check_gltf`, and DataError for a number that no
/// float holds.
std::string glb_bytes(const GltfScene& scene);

/// Writes .glb, or .gltf with its buffer inside, replacing the file as a whole. Throws LogicError
/// for another extension, EnvironmentError if the file cannot be written.
void write_gltf(const std::filesystem::path& path, const GltfScene& scene);

}  // namespace atelier
