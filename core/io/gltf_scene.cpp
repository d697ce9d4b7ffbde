#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/io/mesh_gltf.h"
#include "core/io/text_writer.h"

namespace atelier {
namespace {

/// Nodes with parents before their children. Throws LogicError if there is a cycle.
std::vector<int> parents_first(const GltfScene& scene) {
  const std::size_t count = scene.nodes.size();
  std::vector<std::vector<int>> children(count);
  std::vector<int> order;
  for (std::size_t i = 0; i < count; ++i) {
    const int parent = scene.nodes[i].parent;
    ATELIER_CHECK(parent >= -1 && parent < static_cast<int>(count), "parent out of range");
    if (parent < 0) {
      order.push_back(static_cast<int>(i));
    } else {
      children[parent].push_back(static_cast<int>(i));
    }
  }
  for (std::size_t next = 0; next < order.size(); ++next) {
    const std::vector<int>& below = children[order[next]];
    order.insert(order.end(), below.begin(), below.end());
  }
  ATELIER_CHECK(order.size() == count, "a node that is its own ancestor");
  return order;
}

void check_primitive(const GltfPrimitive& primitive, std::size_t targets) {
  const Index vertices = primitive.mesh.vertices.rows();
  const auto agrees = [vertices](Index rows) { return rows == 0 || rows == vertices; };
  ATELIER_CHECK(agrees(primitive.joints.rows()) && agrees(primitive.weights.rows()) &&
                    primitive.joints.rows() == primitive.weights.rows() &&
                    primitive.joints.cols() == primitive.weights.cols() &&
                    primitive.joints.cols() % 4 == 0,
                "joints and weights need a row a vertex and columns by four");
  ATELIER_CHECK(primitive.targets.size() == targets, "primitives of a mesh share their targets");
  for (const GltfMorphTarget& target : primitive.targets) {
    ATELIER_CHECK(agrees(target.positions.rows()) && agrees(target.normals.rows()),
                  "a morph target needs a row a vertex");
  }
  ATELIER_CHECK(primitive.mesh.faces.size() == 0 || (primitive.mesh.faces.minCoeff() >= 0 &&
                                                     primitive.mesh.faces.maxCoeff() < vertices),
                "a face with a vertex out of range");
}

void check_channel(const GltfChannel& channel, const GltfScene& scene) {
  ATELIER_CHECK(channel.node >= 0 && channel.node < std::ssize(scene.nodes),
                "a channel without a node");
  const int mesh = scene.nodes[channel.node].mesh;
  Index width = channel.path == GltfPath::Rotation ? 4 : 3;
  if (channel.path == GltfPath::Weights) {
    ATELIER_CHECK(mesh >= 0 && !scene.meshes[mesh].primitives.empty(),
                  "weights of a node without a mesh");
    width = std::ssize(scene.meshes[mesh].primitives.front().targets);
  }
  const Index keys = std::ssize(channel.times);
  const Index rows = channel.interpolation == GltfInterpolation::CubicSpline ? 3 * keys : keys;
  ATELIER_CHECK(keys > 0 && channel.values.rows() == rows && channel.values.cols() == width,
                "the values of a channel do not fit its times");
  ATELIER_CHECK(std::is_sorted(channel.times.begin(), channel.times.end(),
                               [](double a, double b) { return a <= b; }),
                "the times of a channel do not increase");
}

/// One primitive at one place of the world.
struct Placed {
  const GltfPrimitive* primitive = nullptr;
  const GltfNode* node = nullptr;
  const GltfMesh* mesh = nullptr;
};

/// Sums of transforms by their weights: [joint] world from mesh.
std::vector<Eigen::Matrix4d> skin_matrices(const GltfSkin& skin,
                                           const std::vector<Eigen::Matrix4d>& world) {
  std::vector<Eigen::Matrix4d> matrices;
  for (std::size_t j = 0; j < skin.joints.size(); ++j) {
    matrices.push_back(world[skin.joints[j]] * skin.inverse_binds[j]);
  }
  return matrices;
}

/// Where all joints have moved alike, any blend of them is right; blends of others are linear.
void check_blend(const GltfSkin& skin, const std::vector<Eigen::Matrix4d>& world,
                 const std::string& file) {
  constexpr double kAlike = 1e-4;  // FBX files hold floats
  if (!skin.dual_quaternions) {
    return;
  }
  const std::vector<Eigen::Matrix4d> matrices = skin_matrices(skin, world);
  for (const Eigen::Matrix4d& matrix : matrices) {
    if (!matrix.isApprox(matrices.front(), kAlike)) {
      throw DataError(file, "skin " + skin.name,
                      "a skin blended by dual quaternions, out of its bind pose",
                      "one that is blended linearly (Maya: Classic Linear), or the bind pose");
    }
  }
}

Eigen::Matrix4d blended(const std::vector<Eigen::Matrix4d>& matrices,
                        const GltfPrimitive& primitive, Index v) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  double total = 0;
  for (Index k = 0; k < primitive.joints.cols(); ++k) {
    const double weight = primitive.weights(v, k);
    if (weight > 0) {
      sum += weight * matrices[primitive.joints(v, k)];
      total += weight;
    }
  }
  return total > 0 ? Eigen::Matrix4d(sum / total) : matrices.front();
}

/// Morphed and transformed.
Mesh placed_mesh(const Placed& placed, const GltfScene& scene,
                 const std::vector<Eigen::Matrix4d>& world) {
  const GltfPrimitive& primitive = *placed.primitive;
  Mesh mesh = primitive.mesh;
  const std::vector<double>& weights =
      placed.node->weights.empty() ? placed.mesh->weights : placed.node->weights;
  for (std::size_t t = 0; t < primitive.targets.size() && t < weights.size(); ++t) {
    if (primitive.targets[t].positions.rows() > 0) {
      mesh.vertices += weights[t] * primitive.targets[t].positions;
    }
    if (primitive.targets[t].normals.rows() > 0 && mesh.normals.rows() > 0) {
      mesh.normals += weights[t] * primitive.targets[t].normals;
    }
  }
  const bool skinned = placed.node->skin >= 0 && primitive.joints.rows() > 0;
  const std::vector<Eigen::Matrix4d> joints =
      skinned ? skin_matrices(scene.skins[placed.node->skin], world)
              : std::vector<Eigen::Matrix4d>();
  const Eigen::Matrix4d& rigid = world[placed.node - scene.nodes.data()];
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Matrix4d transform = skinned ? blended(joints, primitive, v) : rigid;
    const Eigen::Matrix3d linear = transform.topLeftCorner<3, 3>();
    mesh.vertices.row(v) = linear * mesh.vertices.row(v).transpose() + transform.col(3).head<3>();
    if (mesh.normals.rows() > 0) {
      // The matrix of cofactors turns normals also where the linear part has no inverse.
      Eigen::Matrix3d cofactors;
      cofactors.row(0) = linear.row(1).cross(linear.row(2));
      cofactors.row(1) = linear.row(2).cross(linear.row(0));
      cofactors.row(2) = linear.row(0).cross(linear.row(1));
      mesh.normals.row(v) = (cofactors * mesh.normals.row(v).transpose()).stableNormalized();
    }
  }
  if (!skinned && rigid.topLeftCorner<3, 3>().determinant() < 0) {
    mesh.faces.col(1).swap(mesh.faces.col(2));
    mesh.normals = -mesh.normals;
    if (mesh.uv_faces.rows() > 0) {
      mesh.uv_faces.col(1).swap(mesh.uv_faces.col(2));
    }
  }
  return mesh;
}

}  // namespace

Eigen::Matrix4d parent_from_node(const GltfNode& node) {
  if (node.matrix) {
    return *node.matrix;
  }
  const Eigen::Quaterniond rotation(node.rotation[3], node.rotation[0], node.rotation[1],
                                    node.rotation[2]);
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() = rotation.toRotationMatrix() * node.scale.asDiagonal();
  transform.col(3).head<3>() = node.translation;
  return transform;
}

void check_gltf(const GltfScene& scene) {
  parents_first(scene);
  for (const int root : scene.roots) {
    ATELIER_CHECK(root >= 0 && root < std::ssize(scene.nodes), "root out of range");
  }
  for (const GltfMesh& mesh : scene.meshes) {
    for (const GltfPrimitive& primitive : mesh.primitives) {
      check_primitive(primitive, mesh.primitives.front().targets.size());
    }
  }
  for (const GltfSkin& skin : scene.skins) {
    ATELIER_CHECK(!skin.joints.empty() && skin.joints.size() == skin.inverse_binds.size(),
                  "a skin needs joints and as many inverse bind matrices");
    for (const int joint : skin.joints) {
      ATELIER_CHECK(joint >= 0 && joint < std::ssize(scene.nodes), "joint out of range");
    }
  }
  for (const GltfNode& node : scene.nodes) {
    ATELIER_CHECK(node.mesh >= -1 && node.mesh < std::ssize(scene.meshes), "mesh out of range");
    ATELIER_CHECK(node.skin >= -1 && node.skin < std::ssize(scene.skins), "skin out of range");
    if (node.mesh >= 0 && node.skin >= 0) {
      for (const GltfPrimitive& primitive : scene.meshes[node.mesh].primitives) {
        const Index joints = std::ssize(scene.skins[node.skin].joints);
        const bool in_range =
            ((primitive.weights.array() <= 0) ||
             (primitive.joints.array() >= 0 && primitive.joints.array() < static_cast<int>(joints)))
                .all();
        ATELIER_CHECK(in_range, "a vertex with a joint that its skin has not");
      }
    }
  }
  for (const GltfAnimation& animation : scene.animations) {
    for (const GltfChannel& channel : animation.channels) {
      check_channel(channel, scene);
    }
  }
}

std::vector<Eigen::Matrix4d> world_from_nodes(const GltfScene& scene) {
  std::vector<Eigen::Matrix4d> world(scene.nodes.size());
  for (const int node : parents_first(scene)) {
    const int parent = scene.nodes[node].parent;
    const Eigen::Matrix4d local = parent_from_node(scene.nodes[node]);
    world[node] = parent < 0 ? local : Eigen::Matrix4d(world[parent] * local);
  }
  return world;
}

bool says_no_bind_pose(const GltfSkin& skin, const std::vector<Eigen::Matrix4d>& world) {
  constexpr double kSame = 1e-6;
  double apart = 0;
  for (std::size_t s = 0; s < skin.joints.size(); ++s) {
    if (!skin.inverse_binds[s].isIdentity(kSame)) {
      return false;
    }
    apart = std::max(apart, (world[static_cast<std::size_t>(skin.joints[s])] -
                             world[static_cast<std::size_t>(skin.joints[0])])
                                .cwiseAbs()
                                .maxCoeff());
  }
  return apart > kSame;
}

bool stands_in_joint_frames(const GltfMesh& mesh, const std::vector<Eigen::Matrix4d>& joints) {
  double moved = 0;
  double standing = 0;
  for (const GltfPrimitive& primitive : mesh.primitives) {
    for (Index v = 0; v < primitive.joints.rows(); ++v) {
      const Eigen::Vector3d point = primitive.mesh.vertices.row(v);
      for (Index k = 0; k < primitive.joints.cols(); ++k) {
        const double weight = primitive.weights(v, k);
        const int slot = primitive.joints(v, k);
        if (weight > 0 && slot >= 0 && slot < std::ssize(joints)) {
          const Eigen::Matrix4d& joint = joints[static_cast<std::size_t>(slot)];
          moved += weight * point.norm() *
                   std::cbrt(std::abs(joint.topLeftCorner<3, 3>().determinant()));
          standing += weight * (point - joint.topRightCorner<3, 1>()).norm();
        }
      }
    }
  }
  return moved <= standing;
}

std::vector<Finding> torn_mesh_findings(const GltfScene& scene, const std::string& file) {
  std::vector<Finding> findings;
  const std::vector<Eigen::Matrix4d> world = world_from_nodes(scene);
  for (const GltfNode& node : scene.nodes) {
    if (node.mesh < 0 || node.skin < 0) {
      continue;
    }
    const GltfSkin& skin = scene.skins[static_cast<std::size_t>(node.skin)];
    std::vector<Eigen::Matrix4d> joints;
    for (const int joint : skin.joints) {
      joints.push_back(world[static_cast<std::size_t>(joint)]);
    }
    if (says_no_bind_pose(skin, world) &&
        !stands_in_joint_frames(scene.meshes[static_cast<std::size_t>(node.mesh)], joints)) {
      findings.push_back(
          {Severity::Warning, "gltf-binds", file + ": node '" + node.name.substr(0, 40) + "'",
           "the skin has no inverse bind matrices though its mesh stands on its joints: joints "
           "move it once more, as the standard says, and it is torn",
           "export it with inverse bind matrices; as a body it is read as it stands"});
    }
  }
  return findings;
}

Mesh rest_mesh(const GltfScene& scene, const std::string& file, const Limits& limits) {
  const std::vector<Eigen::Matrix4d> world = world_from_nodes(scene);
  std::vector<char> shown(scene.nodes.size(), 0);
  for (const int root : scene.roots) {
    shown[root] = 1;
  }
  std::vector<Placed> all;
  std::int64_t vertices = 0;
  std::int64_t faces = 0;
  Index uv_count = 0;
  bool normals = true;
  bool colors = true;
  bool uvs = true;
  for (const int n : parents_first(scene)) {
    const GltfNode& node = scene.nodes[n];
    shown[n] = static_cast<char>(shown[n] != 0 || (node.parent >= 0 && shown[node.parent] != 0));
    if (shown[n] == 0 || node.mesh < 0) {
      continue;
    }
    if (node.skin >= 0) {
      check_blend(scene.skins[node.skin], world, file);
    }
    for (const GltfPrimitive& primitive : scene.meshes[node.mesh].primitives) {
      all.push_back({&primitive, &node, &scene.meshes[node.mesh]});
      vertices += primitive.mesh.vertices.rows();
      faces += primitive.mesh.faces.rows();
      normals = normals && primitive.mesh.normals.rows() > 0;
      colors = colors && primitive.mesh.colors.rows() > 0;
      uvs = uvs && primitive.mesh.uvs.rows() > 0;
      uv_count += primitive.mesh.uvs.rows();
      if (vertices > limits.mesh_vertices || faces > limits.mesh_faces) {
        throw DataError(file, "nodes", "more vertices or triangles than the limits allow",
                        "fewer instances");
      }
    }
  }
  Mesh mesh;
  mesh.vertices.resize(vertices, 3);
  mesh.faces.resize(faces, 3);
  mesh.normals.resize(normals ? vertices : 0, 3);
  mesh.colors.resize(colors ? vertices : 0, 3);
  mesh.uvs.resize(uvs ? uv_count : 0, 2);
  mesh.uv_faces.resize(uvs ? faces : 0, 3);
  Index vertex = 0;
  Index face = 0;
  Index uv = 0;
  for (const Placed& placed : all) {
    const Mesh part = placed_mesh(placed, scene, world);
    const Index count = part.vertices.rows();
    mesh.vertices.middleRows(vertex, count) = part.vertices;
    mesh.faces.middleRows(face, part.faces.rows()) = part.faces.array() + static_cast<int>(vertex);
    if (normals) {
      mesh.normals.middleRows(vertex, count) = part.normals;
    }
    if (colors) {
      mesh.colors.middleRows(vertex, count) = part.colors;
    }
    if (uvs) {
      mesh.uv_faces.middleRows(face, part.faces.rows()) =
          part.uv_faces.array() + static_cast<int>(uv);
      mesh.uvs.middleRows(uv, part.uvs.rows()) = part.uvs;
      uv += part.uvs.rows();
    }
    vertex += count;
    face += part.faces.rows();
  }
  if (vertices == 0) {
    throw DataError(file, "scene", "no triangles", "a scene with a mesh");
  }
  check_mesh(mesh, file);
  if (const double most = mesh.vertices.cwiseAbs().maxCoeff(); most > limits.mesh_coordinate) {
    throw DataError(file, "scene", "coordinate " + number_text(most),
                    "at most " + number_text(limits.mesh_coordinate));
  }
  return mesh;
}

GltfScene gltf_scene(const Mesh& mesh, const std::string& name) {
  GltfScene scene;
  GltfPrimitive primitive;
  primitive.mesh = mesh;
  GltfMesh& owner = scene.meshes.emplace_back();
  owner.name = name;
  owner.primitives.push_back(std::move(primitive));
  GltfNode node;
  node.name = name;
  node.mesh = 0;
  scene.nodes.push_back(node);
  scene.roots = {0};
  return scene;
}

void show_first_keys(GltfScene& scene) {
  check_gltf(scene);
  if (scene.animations.empty()) {
    return;
  }
  for (const GltfChannel& channel : scene.animations.front().channels) {
    // A cubic spline's first row is the tangent into its first key.
    const Index row = channel.interpolation == GltfInterpolation::CubicSpline ? 1 : 0;
    const Eigen::VectorXd value = channel.values.row(row);
    GltfNode& node = scene.nodes[static_cast<std::size_t>(channel.node)];
    switch (channel.path) {
      case GltfPath::Translation:
        node.translation = value;
        break;
      case GltfPath::Rotation:
        node.rotation = value;
        break;
      case GltfPath::Scale:
        node.scale = value;
        break;
      case GltfPath::Weights:
        node.weights.assign(value.begin(), value.end());
        break;
    }
  }
}

}  // namespace atelier
