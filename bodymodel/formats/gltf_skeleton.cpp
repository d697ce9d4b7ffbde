#include "bodymodel/formats/gltf_skeleton.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "bodymodel/humanoid.h"
#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kUneven = 1e-2;  // how far a frame may be from a rotation times a scale

// The rotation of a frame whose axes may be scaled evenly.
Eigen::Matrix3d rotation_of(const Eigen::Matrix4d& frame, const std::string& file,
                            const std::string& joint) {
  const Eigen::Matrix3d m = frame.topLeftCorner<3, 3>();
  const double scale = std::cbrt(m.determinant());
  const Eigen::Matrix3d rotation = m / scale;
  if (!(scale > 1e-9) || !rotation.allFinite() ||
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > kUneven) {
    throw DataError(file, "joint " + joint, "a bind matrix that mirrors, shears or scales unevenly",
                    "a rotation, a translation and one scale");
  }
  return matrix_of_quaternion(quaternion_of_matrix(rotation));
}

std::string unique_name(const std::string& name, std::size_t joint, std::set<std::string>& seen) {
  std::string unique = name.empty() ? "joint_" + std::to_string(joint) : name;
  for (int number = 2; !seen.insert(unique).second; ++number) {
    unique = name + "_" + std::to_string(number);
  }
  return unique;
}

// Every node behind its parent.
std::vector<int> parents_first(const GltfScene& scene) {
  std::vector<std::vector<int>> children(scene.nodes.size());
  std::vector<int> order;
  for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
    if (scene.nodes[n].parent < 0) {
      order.push_back(static_cast<int>(n));
    } else {
      children[static_cast<std::size_t>(scene.nodes[n].parent)].push_back(static_cast<int>(n));
    }
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::vector<int>& some = children[static_cast<std::size_t>(order[i])];
    order.insert(order.end(), some.begin(), some.end());
  }
  return order;
}

// What an animation moves of a scene.
struct MovedNodes {
  std::vector<int> order;      // of nodes, parents first
  std::vector<char> keyed;     // [nodes] by a channel of its own
  std::vector<int> below;      // [nodes] of the keyed ones, at and below each
  std::vector<char> has_mesh;  // [nodes] at or below it
  int all = 0;                 // keyed ones
  int top = -1;                // the lowest node that all of them are at or below; -1: none
};

MovedNodes moved_nodes(const GltfScene& scene, const GltfAnimation& animation) {
  MovedNodes moved;
  moved.order = parents_first(scene);
  moved.keyed.resize(scene.nodes.size(), 0);
  moved.has_mesh.resize(scene.nodes.size(), 0);
  for (const GltfChannel& channel : animation.channels) {
    if (channel.node >= 0 && !channel.times.empty() &&
        (channel.path == GltfPath::Rotation || channel.path == GltfPath::Translation)) {
      moved.keyed[static_cast<std::size_t>(channel.node)] = 1;
    }
  }
  moved.below.assign(moved.keyed.begin(), moved.keyed.end());
  for (const char n : moved.keyed) {
    moved.all += n;
  }
  for (auto at = moved.order.rbegin(); at != moved.order.rend(); ++at) {
    const auto n = static_cast<std::size_t>(*at);
    const int parent = scene.nodes[n].parent;
    moved.has_mesh[n] = static_cast<char>(moved.has_mesh[n] != 0 || scene.nodes[n].mesh >= 0);
    moved.top = moved.top < 0 && moved.below[n] == moved.all ? *at : moved.top;
    if (parent >= 0) {
      moved.below[static_cast<std::size_t>(parent)] += moved.below[n];
      moved.has_mesh[static_cast<std::size_t>(parent)] |= moved.has_mesh[n];
    }
  }
  return moved;
}

// The skin of what is moved at and below `top`.
GltfSkin skin_below(int top, const MovedNodes& moved, const GltfScene& scene,
                    const std::vector<Eigen::Matrix4d>& world) {
  std::vector<char> joint(scene.nodes.size(), 0);
  joint[static_cast<std::size_t>(top)] = 1;
  GltfSkin skin;
  skin.name = scene.nodes[static_cast<std::size_t>(top)].name;
  for (const int node : moved.order) {
    const auto n = static_cast<std::size_t>(node);
    const int parent = scene.nodes[n].parent;
    if (node != top && parent >= 0 && joint[static_cast<std::size_t>(parent)] != 0) {
      joint[n] = static_cast<char>(moved.below[n] > 0 || moved.has_mesh[n] == 0);
    }
    if (joint[n] != 0) {
      skin.joints.push_back(node);
      skin.inverse_binds.push_back(world[n].inverse());
    }
  }
  return skin;
}

// The subtrees below a node that stays, or below none, of which each is a person.
std::vector<GltfSkin> people_of_animation(const MovedNodes& moved, const GltfScene& scene,
                                          const std::vector<Eigen::Matrix4d>& world,
                                          const std::string& file) {
  constexpr int kFewestMoved = 6;  // of a person's nodes
  std::vector<GltfSkin> people;
  if (moved.top >= 0 && moved.keyed[static_cast<std::size_t>(moved.top)] != 0) {
    return people;
  }
  GltfScene alone;
  alone.nodes = scene.nodes;
  for (const int node : moved.order) {
    if (scene.nodes[static_cast<std::size_t>(node)].parent != moved.top ||
        moved.below[static_cast<std::size_t>(node)] < kFewestMoved) {
      continue;
    }
    alone.skins = {skin_below(node, moved, scene, world)};
    if (find_humanoid(gltf_skeleton(alone, 0, file).skeleton)) {
      people.push_back(std::move(alone.skins[0]));
    }
  }
  return people;
}

}  // namespace

std::vector<GltfSkin> skins_of_animation(const GltfScene& scene, const GltfAnimation& animation,
                                         const std::string& file) {
  const MovedNodes moved = moved_nodes(scene, animation);
  if (moved.all == 0) {
    throw DataError(file, "animation " + animation.name, "no channel that turns or shifts a node",
                    "a motion of a skeleton");
  }
  const std::vector<Eigen::Matrix4d> world = world_from_nodes(scene);
  std::vector<GltfSkin> people = people_of_animation(moved, scene, world, file);
  if (people.size() > 1) {
    return people;
  }
  if (moved.top < 0) {
    throw DataError(file, "animation " + animation.name, "moved nodes that hang on no common node",
                    "one skeleton");
  }
  return {skin_below(moved.top, moved, scene, world)};
}

GltfSkeleton gltf_skeleton(const GltfScene& scene, int skin_index, const std::string& file) {
  GltfSkin skin = scene.skins[static_cast<std::size_t>(skin_index)];
  if (skin.joints.empty()) {
    throw DataError(file, "skin " + skin.name, "no joints", "one or more");
  }
  const std::size_t count = skin.joints.size();
  std::vector<int> slot_of_node(scene.nodes.size(), -1);
  for (std::size_t s = 0; s < count; ++s) {
    slot_of_node[static_cast<std::size_t>(skin.joints[s])] = static_cast<int>(s);
  }
  // The nearest joint above each joint; other nodes between them are passed by.
  std::vector<int> parent(count, -1);
  std::vector<std::size_t> depth(count, 0);
  for (std::size_t s = 0; s < count; ++s) {
    for (int node = scene.nodes[static_cast<std::size_t>(skin.joints[s])].parent; node >= 0;
         node = scene.nodes[static_cast<std::size_t>(node)].parent) {
      if (parent[s] < 0) {
        parent[s] = slot_of_node[static_cast<std::size_t>(node)];
      }
      ++depth[s];
    }
  }
  std::vector<std::size_t> order(count);
  for (std::size_t s = 0; s < count; ++s) {
    order[s] = s;
  }
  bool parents_first = parent[0] < 0;
  for (std::size_t s = 1; s < count; ++s) {
    parents_first = parents_first && parent[s] < static_cast<int>(s);
  }
  if (!parents_first) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return depth[a] < depth[b]; });
  }

  GltfSkeleton result;
  result.number.resize(count);
  const std::vector<Eigen::Matrix4d> world = world_from_nodes(scene);
  if (says_no_bind_pose(skin, world)) {
    for (std::size_t s = 0; s < count; ++s) {
      const Eigen::Matrix4d& frame = world[static_cast<std::size_t>(skin.joints[s])];
      result.unbound.push_back(frame);
      skin.inverse_binds[s] = frame.inverse();
    }
  }
  const std::size_t root = order[0];
  result.world_from_mesh =
      world[static_cast<std::size_t>(skin.joints[root])] * skin.inverse_binds[root];
  std::set<std::string> seen;
  std::vector<Eigen::Matrix3d> rotations;
  Points positions(static_cast<Index>(count), 3);
  Skeleton& skeleton = result.skeleton;
  skeleton.offsets.resize(static_cast<Index>(count), 3);
  skeleton.rest_rotations.resize(static_cast<Index>(count), 3);
  for (std::size_t j = 0; j < count; ++j) {
    const std::size_t s = order[j];
    result.number[s] = static_cast<int>(j);
    result.nodes.push_back(skin.joints[s]);
    const std::string& name = scene.nodes[static_cast<std::size_t>(skin.joints[s])].name;
    skeleton.names.push_back(unique_name(name, j, seen));
    if (skeleton.names.back() != name) {
      result.findings.push_back({Severity::Note, "gltf-names", file,
                                 "joint name '" + name + "' is empty or used twice",
                                 "it is now " + skeleton.names.back()});
    }
    if (j > 0 && parent[s] < 0) {
      throw DataError(file, "skin " + skin.name,
                      "two roots, " + skeleton.names[0] + " and " + skeleton.names.back(),
                      "one joint that the others hang on");
    }
    const int above = parent[s] < 0 ? -1 : result.number[static_cast<std::size_t>(parent[s])];
    skeleton.parents.push_back(above);
    const Eigen::Matrix4d frame = result.world_from_mesh * skin.inverse_binds[s].inverse();
    if (!frame.allFinite()) {
      throw DataError(file, "joint " + skeleton.names.back(), "a bind matrix without an inverse",
                      "a rotation, a translation and one scale");
    }
    rotations.push_back(rotation_of(frame, file, skeleton.names.back()));
    const Index row = static_cast<Index>(j);
    positions.row(row) = frame.topRightCorner<3, 1>();
    if (above < 0) {
      skeleton.offsets.row(row) = positions.row(row);
      skeleton.rest_rotations.row(row) = rotation_vector(rotations[j]);
    } else {
      const Eigen::Matrix3d inverse = rotations[static_cast<std::size_t>(above)].transpose();
      skeleton.offsets.row(row) = inverse * (positions.row(row) - positions.row(above)).transpose();
      skeleton.rest_rotations.row(row) = rotation_vector(inverse * rotations[j]);
    }
  }
  return result;
}

}  // namespace atelier
