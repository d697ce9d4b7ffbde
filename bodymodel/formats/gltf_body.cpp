#include "bodymodel/formats/gltf_body.h"

#include <Eigen/LU>
#include <cmath>
#include <set>
#include <utility>

#include "bodymodel/formats/body_seams.h"
#include "bodymodel/formats/gltf_skeleton.h"
#include "bodymodel/formats/skin_weights.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/missing_frames.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/scene_file.h"
#include "core/io/text_writer.h"
#include "core/normals.h"

namespace atelier {
namespace {

// Where the vertices of a mesh stand in the bind pose, or how far displacements of them go there.
class MeshPlace {
 public:
  explicit MeshPlace(const Eigen::Matrix4d& world_from_mesh) : whole_(world_from_mesh) {}
  explicit MeshPlace(std::vector<Eigen::Matrix4d> each) : each_(std::move(each)) {}

  // One by one, so that equal points stay equal to the last bit. `first`: of the mesh's vertices.
  Points points(const Points& points, Index first) const { return moved(points, first, 1); }
  Points displacements(const Points& points, Index first) const { return moved(points, first, 0); }

 private:
  Points moved(const Points& points, Index first, double shift) const {
    Points result(points.rows(), 3);
    for (Index i = 0; i < points.rows(); ++i) {
      const Eigen::Matrix4d& frame =
          each_.empty() ? whole_ : each_[static_cast<std::size_t>(first + i)];
      const Eigen::Matrix3d linear = frame.topLeftCorner<3, 3>();
      const Eigen::Vector3d offset = frame.topRightCorner<3, 1>();
      const Eigen::Vector3d point = points.row(i);
      result.row(i) = linear * point + shift * offset;
    }
    return result;
  }

  Eigen::Matrix4d whole_ = Eigen::Matrix4d::Identity();
  std::vector<Eigen::Matrix4d> each_;
};

// Where a mesh stands whose skin says no bind pose (stands_in_joint_frames).
MeshPlace unbound_place(const GltfMesh& source, const GltfSkeleton& tree, const std::string& file,
                        std::vector<Finding>& findings) {
  std::vector<Eigen::Matrix4d> frames;  // of each vertex, those of its joints
  for (const GltfPrimitive& primitive : source.primitives) {
    for (Index v = 0; v < primitive.joints.rows(); ++v) {
      Eigen::Matrix4d frame = Eigen::Matrix4d::Zero();
      double sum = 0;
      for (Index k = 0; k < primitive.joints.cols(); ++k) {
        const double weight = primitive.weights(v, k);
        const int slot = primitive.joints(v, k);
        if (weight > 0 && slot >= 0 && slot < static_cast<int>(tree.unbound.size())) {
          frame += weight * tree.unbound[static_cast<std::size_t>(slot)];
          sum += weight;
        }
      }
      frames.push_back(sum > 0 ? Eigen::Matrix4d(frame / sum) : Eigen::Matrix4d::Identity());
    }
  }
  const bool by_joints = stands_in_joint_frames(source, tree.unbound);
  findings.push_back({Severity::Warning, "gltf-binds", file,
                      "the skin has no inverse bind matrices; its joints are taken as their nodes "
                      "stand",
                      by_joints ? "the mesh is moved by them, as the standard says"
                                : "the mesh is taken as standing on them, which viewers show torn: "
                                  "export it with inverse bind matrices"});
  return by_joints ? MeshPlace(std::move(frames)) : MeshPlace(Eigen::Matrix4d::Identity().eval());
}

template <class Matrix>
void append(Matrix& all, const Matrix& more) {
  Matrix joined(all.rows() + more.rows(), more.cols());
  joined << all, more;
  all = std::move(joined);
}

// The first mesh that wears a skin; what others wear one is said.
int skinned_node(const GltfScene& scene, const std::string& file, std::vector<Finding>& findings) {
  int first = -1;
  std::string others;
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    if (scene.nodes[n].mesh < 0 || scene.nodes[n].skin < 0) {
      continue;
    }
    if (first < 0) {
      first = static_cast<int>(n);
    } else {
      others += (others.empty() ? "'" : ", '") + scene.nodes[n].name.substr(0, 40) + "'";
    }
  }
  if (!others.empty()) {
    findings.push_back({Severity::Note, "gltf-meshes", file,
                        "several meshes with a skin: '" +
                            scene.nodes[static_cast<std::size_t>(first)].name.substr(0, 40) +
                            "' is read as the body",
                        "left out: " + others.substr(0, 200)});
  }
  if (first >= 0) {
    return first;
  }
  throw DataError(file, "nodes", "no mesh with a skin", "a skinned mesh");
}

// Eigen's << does not take empty blocks.
void append_rows(Mesh& mesh, const Mesh& part, bool uvs) {
  const int vertices = static_cast<int>(mesh.vertices.rows());
  const int coordinates = static_cast<int>(mesh.uvs.rows());
  const Triangles faces = part.faces.array() + vertices;
  if (vertices == 0) {
    mesh.vertices = part.vertices;
    mesh.faces = part.faces;
    if (uvs) {
      mesh.uvs = part.uvs;
      mesh.uv_faces = part.uv_faces;
    }
    return;
  }
  append(mesh.vertices, part.vertices);
  append(mesh.faces, faces);
  if (uvs) {
    append(mesh.uvs, part.uvs);
    const Triangles uv_faces = part.uv_faces.array() + coordinates;
    append(mesh.uv_faces, uv_faces);
  }
}

// A body starts with all parameters at 0, a file may show itself at others.
void tell_weights(const GltfMesh& mesh, const GltfNode& node, const std::string& file,
                  std::vector<Finding>& findings) {
  const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
  std::string told;
  for (std::size_t t = 0; t < weights.size(); ++t) {
    if (weights[t] != 0 && told.size() < 200) {
      const bool named = t < mesh.target_names.size() && !mesh.target_names[t].empty();
      told += (told.empty() ? "" : ", ") +
              (named ? mesh.target_names[t] : "morph_" + std::to_string(t)) + " " +
              number_text(std::round(weights[t] * 1e4) / 1e4);
    }
  }
  if (!told.empty()) {
    findings.push_back(
        {Severity::Warning, "gltf-weights", file,
         "the file shows the body with blend shapes at " + told,
         "they are shape parameters of the body and start at 0: set them by --shape"});
  }
}

void add_shape(const GltfMesh& source, const MeshPlace& place, BodyModel& model) {
  const std::size_t targets = source.primitives[0].targets.size();
  for (std::size_t t = 0; t < targets; ++t) {
    ShapeParameter parameter;
    parameter.name = t < source.target_names.size() && !source.target_names[t].empty() &&
                             find_shape(model, source.target_names[t]) < 0
                         ? source.target_names[t]
                         : "morph_" + std::to_string(t);
    parameter.min = 0;
    parameter.max = 1;
    parameter.surface.offsets = Points::Zero(vertex_count(model), 3);
    Index row = 0;
    for (const GltfPrimitive& primitive : source.primitives) {
      const Points& moved = primitive.targets[t].positions;
      if (moved.rows() > 0) {
        parameter.surface.offsets.middleRows(row, moved.rows()) = place.displacements(moved, row);
      }
      row += primitive.mesh.vertices.rows();
    }
    parameter.joints = Points::Zero(joint_count(model), 3);
    model.shape.push_back(std::move(parameter));
  }
}

}  // namespace

GltfBody read_gltf_body(const GltfScene& scene, const std::string& file) {
  GltfBody body;
  const GltfNode& node =
      scene.nodes[static_cast<std::size_t>(skinned_node(scene, file, body.findings))];
  const GltfMesh& source = scene.meshes[static_cast<std::size_t>(node.mesh)];
  if (source.primitives.empty()) {
    throw DataError(file, "mesh " + source.name, "no triangles with positions", "a skinned mesh");
  }
  if (scene.skins[static_cast<std::size_t>(node.skin)].dual_quaternions) {
    throw DataError(
        file, "skin " + scene.skins[static_cast<std::size_t>(node.skin)].name,
        "a skin blended by dual quaternions, which no body model here is",
        "one that is blended linearly: Maya's Classic Linear, 3ds Max without DQ Skinning");
  }
  tell_weights(source, node, file, body.findings);
  const GltfSkeleton tree = gltf_skeleton(scene, node.skin, file);
  body.findings.insert(body.findings.end(), tree.findings.begin(), tree.findings.end());
  BodyModel& model = body.model;
  model.name = source.name.empty() ? "gltf" : source.name;
  model.skeleton = tree.skeleton;
  bool uvs = true;
  for (const GltfPrimitive& primitive : source.primitives) {
    uvs = uvs && primitive.mesh.uvs.rows() > 0;
  }
  std::vector<std::vector<Influence>> influences;
  for (const GltfPrimitive& primitive : source.primitives) {
    if (primitive.joints.rows() != primitive.mesh.vertices.rows()) {
      throw DataError(file, "mesh " + source.name, "a primitive without JOINTS_0 and WEIGHTS_0",
                      "joints and weights in every primitive of a skinned mesh");
    }
    append_rows(model.mesh, primitive.mesh, uvs);
    for (Index v = 0; v < primitive.joints.rows(); ++v) {
      std::vector<Influence> row;
      for (Index k = 0; k < primitive.joints.cols(); ++k) {
        if (primitive.weights(v, k) > 0) {
          const int slot = primitive.joints(v, k);
          if (slot < 0 || slot >= static_cast<int>(tree.number.size())) {
            throw DataError(file, "mesh " + source.name, "joint " + std::to_string(slot),
                            "a joint of the skin");
          }
          row.push_back({tree.number[static_cast<std::size_t>(slot)], primitive.weights(v, k)});
        }
      }
      influences.push_back(std::move(row));
    }
  }
  const MeshPlace place = tree.unbound.empty() ? MeshPlace(tree.world_from_mesh)
                                               : unbound_place(source, tree, file, body.findings);
  model.mesh.vertices = place.points(model.mesh.vertices, 0);
  SkinPackOptions pack;
  pack.tolerance = 1e-2;  // bytes and shorts do not sum to 1 exactly
  PackedSkin packed = pack_skin_weights(influences, joint_count(model), pack, file);
  model.skin = std::move(packed.skin);
  body.findings.insert(body.findings.end(), packed.findings.begin(), packed.findings.end());
  add_shape(source, place, model);
  check_body_model(model, file);
  model = without_seams(std::move(model));
  return body;
}

GltfBody read_gltf_body(const std::filesystem::path& path, const Limits& limits) {
  const GltfScene scene = read_scene(path, limits);
  GltfBody body = read_gltf_body(scene, path.string());
  body.findings.insert(body.findings.begin(), scene.findings.begin(), scene.findings.end());
  body.model.name = path.stem().string();
  return body;
}

namespace {

constexpr int kGltfSlots = 4;  // influences a vertex: three.js and others cut off what goes beyond

// A node for each joint, at rest.
void add_joint_nodes(const Skeleton& skeleton, GltfScene& scene) {
  for (Index j = 0; j < static_cast<Index>(skeleton.names.size()); ++j) {
    GltfNode node;
    node.name = skeleton.names[static_cast<std::size_t>(j)];
    node.parent = skeleton.parents[static_cast<std::size_t>(j)];
    node.translation = skeleton.offsets.row(j);
    if (skeleton.rest_rotations.rows() > 0) {
      node.rotation = quaternion_of_matrix(rotation_matrix(skeleton.rest_rotations.row(j)));
    }
    scene.nodes.push_back(node);
  }
}

GltfSkin skin_of_joints(const Points& joints, const std::vector<Eigen::Matrix3d>& rotations) {
  GltfSkin skin;
  for (Index j = 0; j < joints.rows(); ++j) {
    skin.joints.push_back(static_cast<int>(j));
    const Eigen::Matrix3d inverse = rotations[static_cast<std::size_t>(j)].transpose();
    Eigen::Matrix4d bind = Eigen::Matrix4d::Identity();
    bind.topLeftCorner<3, 3>() = inverse;
    bind.topRightCorner<3, 1>() = -inverse * joints.row(j).transpose();
    skin.inverse_binds.push_back(bind);
  }
  return skin;
}

GltfAnimation animation_of(const Skeleton& skeleton, const Motion& motion) {
  ATELIER_CHECK(motion.fps > 0, "frame rate is positive");
  const Index joints = static_cast<Index>(skeleton.names.size());
  GltfAnimation animation;
  animation.name = "motion";
  std::vector<double> times;
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    ATELIER_CHECK(motion.poses[i].rotations.rows() == joints, "poses of another skeleton");
    times.push_back(static_cast<double>(i) / motion.fps);
  }
  const Index count = static_cast<Index>(times.size());
  GltfChannel path{0, GltfPath::Translation, GltfInterpolation::Linear, times, {}};
  path.values.resize(count, 3);
  for (Index i = 0; i < count; ++i) {
    path.values.row(i) = skeleton.offsets.row(0) +
                         motion.poses[static_cast<std::size_t>(i)].root_translation.transpose();
  }
  animation.channels.push_back(std::move(path));
  for (Index j = 0; j < joints; ++j) {
    GltfChannel turn{static_cast<int>(j), GltfPath::Rotation, GltfInterpolation::Linear, times, {}};
    turn.values.resize(count, 4);
    Eigen::Matrix3d rest = Eigen::Matrix3d::Identity();
    if (skeleton.rest_rotations.rows() > 0) {
      rest = rotation_matrix(skeleton.rest_rotations.row(j));
    }
    for (Index i = 0; i < count; ++i) {
      turn.values.row(i) = quaternion_of_matrix(
          rest * rotation_matrix(motion.poses[static_cast<std::size_t>(i)].rotations.row(j)));
    }
    animation.channels.push_back(std::move(turn));
  }
  return animation;
}

}  // namespace

GltfScene gltf_body(const BodyModel& model, const Eigen::VectorXd& shape, const Motion& motion) {
  const ShapedBody body = shape_body(model, shape);
  GltfScene scene;
  add_joint_nodes(body.skeleton, scene);
  GltfNode mesh_node;
  mesh_node.name = model.name;
  mesh_node.mesh = 0;
  mesh_node.skin = 0;
  scene.roots = {0, static_cast<int>(scene.nodes.size())};
  scene.nodes.push_back(mesh_node);
  scene.skins.push_back(skin_of_joints(body.joints, body.rest_rotations));
  scene.skins.back().name = model.name;

  GltfPrimitive primitive;
  primitive.mesh.vertices = body.vertices;
  primitive.mesh.faces = model.mesh.faces;
  primitive.mesh.normals = vertex_normals(body.vertices, model.mesh.faces);
  primitive.mesh.uvs = model.mesh.uvs;
  primitive.mesh.uv_faces = model.mesh.uv_faces;
  const SkinWeights skin =
      repair_skin_weights(model.skin, joint_count(model), {.max_slots = kGltfSlots}).skin;
  primitive.joints.setZero(vertex_count(model), kGltfSlots);
  primitive.weights.setZero(vertex_count(model), kGltfSlots);
  primitive.joints.leftCols(skin.joints.cols()) = skin.joints;
  primitive.weights.leftCols(skin.weights.cols()) = skin.weights;
  scene.meshes.push_back({model.name, {primitive}, {}, {}});
  if (!motion.poses.empty()) {
    scene.animations.push_back(animation_of(body.skeleton, motion));
  }
  return scene;
}

GltfScene gltf_motion(const MotionClip& clip) {
  check_motion_clip(clip);
  GltfScene scene;
  add_joint_nodes(clip.skeleton, scene);
  scene.roots = {0};
  const JointFrames rest = forward_kinematics(clip.skeleton, rest_pose(clip.skeleton));
  scene.skins.push_back(skin_of_joints(rest.positions, rest.rotations));
  scene.skins.back().name = clip.name;
  scene.animations.push_back(animation_of(clip.skeleton, without_gaps(clip.motion)));
  return scene;
}

Index gltf_vertex_count(const Mesh& mesh) {
  if (mesh.uv_faces.rows() == 0) {
    return mesh.vertices.rows();
  }
  std::set<std::pair<int, int>> written;
  for (Index i = 0; i < mesh.faces.size(); ++i) {
    written.emplace(mesh.faces.data()[i], mesh.uv_faces.data()[i]);
  }
  return static_cast<Index>(written.size());
}

}  // namespace atelier
