#include "core/io/fbx_import.h"

#ifdef ATELIER_HAS_ASSIMP

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "core/error.h"
#include "core/io/fbx_binds.h"
#include "core/io/fbx_mesh.h"
#include "core/io/fbx_scales.h"
#include "core/io/fbx_shapes.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::size_t kMaxNodes = 65'536;
constexpr double kShear = 1e-5;  // how far axes may be from right angles and still be turned alone
constexpr double kRounded = 1e-4;  // of a matrix: libassimp holds floats
constexpr double kAway = 1e-4;  // of a skeleton's size: how far a root may stand from its bind pose

/// A name as UTF-8, which glTF wants: of one that is none, plain letters stay.
std::string utf8(const aiString& name) {
  std::string text = name.C_Str();
  if (!is_printable_utf8(text)) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c < 32 || c > 126; }, '?');
  }
  return text;
}

/// libassimp's error message, as one line of plain letters.
std::string complaint(std::string text) {
  constexpr std::size_t kShown = 160;
  text.resize(std::min(text.size(), kShown));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < 32 || c > 126; }, '?');
  return "libassimp: " + text;
}

Eigen::Matrix4d matrix_of(const aiMatrix4x4& m) {
  Eigen::Matrix4d result;
  result << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2,
      m.d3, m.d4;
  return result;
}

/// As translation, rotation and scale, which channels can move; as a matrix where it shears.
void set_transform(const Eigen::Matrix4d& transform, GltfNode& node) {
  const Eigen::Matrix3d linear = transform.topLeftCorner<3, 3>();
  Eigen::Vector3d scale = linear.colwise().norm();
  if (linear.determinant() < 0) {
    scale.x() = -scale.x();
  }
  const Eigen::Matrix3d axes = linear * scale.cwiseInverse().asDiagonal();
  if (!axes.allFinite() ||
      (axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm() > kShear) {
    node.matrix = transform;
    return;
  }
  node.matrix.reset();
  node.translation = transform.topRightCorner<3, 1>();
  node.rotation = Eigen::Quaterniond(axes).normalized().coeffs();
  node.scale = scale;
}

/// Builds the scene: node 0 stands for the file's unit and axes, the others are the file's, parents
/// first. "The file's space" is below node 0.
class FbxImport {
 public:
  FbxImport(const aiScene& source, std::span<const std::byte> bytes, const std::string& name,
            const Limits& limits)
      : source_(source),
        binds_(fbx_binds(bytes)),
        models_(fbx_models(bytes)),
        shapes_(bytes),
        name_(name),
        limits_(limits) {}

  GltfScene scene() {
    add_axes();
    add_nodes();
    add_lost_turns();
    add_kept_scales();
    add_static_meshes();
    find_joints();
    if (!joints_.empty()) {
      add_skin();
    }
    add_animations();
    return std::move(scene_);
  }

 private:
  struct Place {
    const aiMesh* mesh;
    int node;
  };

  void add_axes();
  void add_nodes();
  void add_lost_turns();
  void add_kept_scales();
  void set_rest();
  Eigen::Matrix4d mesh_place(int node) const;
  void add_static_meshes();
  void find_joints();
  void add_joints_between(const std::vector<int>& seeds);
  Eigen::Matrix4d bound_place(const Place& place) const;
  void set_bind_poses();
  void add_skin();
  void add_part(const Place& place, GltfMesh& mesh, const Eigen::Matrix4d& node_from_mesh);
  void add_shapes(FbxPrimitive& part, GltfMesh& mesh) const;
  void add_animations();
  bool add_root(GltfAnimation& animation);
  int unscalable(const aiAnimation& animation) const;
  int node_of(const aiString& name) const;
  int setting(const char* key, int otherwise, int least, int most);
  void note(Severity severity, const char* code, const std::string& what,
            const std::string& advice) {
    scene_.findings.push_back({severity, code, "", what, advice});
  }
  [[noreturn]] void fail(const std::string& where, const std::string& found,
                         const std::string& expected) const {
    throw DataError(name_, where, found, expected);
  }

  const aiScene& source_;
  std::vector<FbxBind> binds_;
  std::vector<FbxModel> models_;
  FbxShapes shapes_;
  std::string name_;
  Limits limits_;
  GltfScene scene_;
  std::vector<const aiNode*> nodes_;   ///< [N-1] of the file, node i + 1 of the scene
  std::vector<Eigen::Matrix4d> rest_;  ///< [N] file's space from node, as the file stands
  std::vector<std::optional<Eigen::Matrix4d>> bind_;  ///< [N] the same when the skin was bound
  std::map<std::string, int> node_by_name_;
  std::map<int, Eigen::Matrix4d> geometric_;  ///< node from mesh, where they differ
  std::vector<char> post_turned_;             ///< [N] whose rotation is followed by another
  std::vector<FbxScale> scales_;              ///< [N]
  std::vector<Eigen::Vector3d> own_scales_;   ///< [N] as the file has them
  std::optional<GltfNode> saved_root_;        ///< as it stands in the file, not in its bind pose
  std::vector<Place> skinned_;
  std::vector<int> joints_;  ///< nodes, parents first
  std::vector<int> slot_;    ///< [N] into joints_, or -1
};

int FbxImport::setting(const char* key, int otherwise, int least, int most) {
  int value = otherwise;
  if (source_.mMetaData == nullptr || !source_.mMetaData->Get(key, value)) {
    return otherwise;
  }
  if (value < least || value > most) {
    fail("GlobalSettings " + std::string(key), std::to_string(value),
         std::to_string(least) + " to " + std::to_string(most));
  }
  return value;
}

void FbxImport::add_axes() {
  const int axis[3] = {setting("CoordAxis", 0, 0, 2), setting("UpAxis", 1, 0, 2),
                       setting("FrontAxis", 2, 0, 2)};
  const int sign[3] = {setting("CoordAxisSign", 1, -1, 1), setting("UpAxisSign", 1, -1, 1),
                       setting("FrontAxisSign", 1, -1, 1)};
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();  // a row for each of ours: right, up, front
  for (int row = 0; row < 3; ++row) {
    turn(row, axis[row]) = sign[row];
  }
  if (std::abs(turn.determinant() - 1) > 0.5) {
    fail("GlobalSettings",
         "CoordAxis, UpAxis and FrontAxis that are not right-handed or name one axis twice",
         "three axes of a right-handed frame");
  }
  float centimetres = 1;
  if (source_.mMetaData != nullptr) {
    source_.mMetaData->Get("UnitScaleFactor", centimetres);
  }
  const std::string digits = number_text(centimetres);  // of the float: 2.54, not 2.53999996
  if (!(centimetres > 1e-6F && centimetres < 1e9F)) {
    fail("GlobalSettings UnitScaleFactor", digits, "the file's unit in centimetres");
  }
  const double metres = std::stod(digits) / 100;
  GltfNode node;
  node.name = "fbx";
  node.scale.setConstant(metres);
  node.rotation = Eigen::Quaterniond(turn).normalized().coeffs();
  scene_.nodes.push_back(node);
  scene_.roots = {0};
}

void FbxImport::add_nodes() {
  if (source_.mRootNode == nullptr) {
    fail("", "no nodes", "an FBX scene");
  }
  rest_.push_back(Eigen::Matrix4d::Identity());
  // The root is libassimp's own; newer versions of it turn the axes there.
  std::vector<std::pair<const aiNode*, int>> waiting = {{source_.mRootNode, 0}};
  while (!waiting.empty()) {
    const auto [above, parent] = waiting.back();
    waiting.pop_back();
    if (above != source_.mRootNode) {
      const Eigen::Matrix4d transform = matrix_of(above->mTransformation);
      if (!transform.allFinite()) {
        fail("node " + in_quotes(above->mName.C_Str()), "a transform that is not finite",
             "numbers");
      }
      GltfNode node;
      node.name = utf8(above->mName);
      node.parent = parent;
      set_transform(transform, node);
      rest_.push_back(rest_[static_cast<std::size_t>(parent)] * parent_from_node(node));
      node_by_name_.try_emplace(above->mName.C_Str(), static_cast<int>(scene_.nodes.size()));
      scene_.nodes.push_back(std::move(node));
      nodes_.push_back(above);
    }
    const int self = above == source_.mRootNode ? 0 : static_cast<int>(scene_.nodes.size()) - 1;
    if (scene_.nodes.size() + waiting.size() + above->mNumChildren > kMaxNodes) {
      fail("", "more than " + std::to_string(kMaxNodes) + " nodes", "a smaller scene");
    }
    for (unsigned c = above->mNumChildren; c > 0; --c) {
      waiting.emplace_back(above->mChildren[c - 1], self);
    }
  }
}

/// Rotations of FBX about fixed axes, in an order as FbxModel has it.
Eigen::Quaterniond turn_of_degrees(const Eigen::Vector3d& degrees, int order = 0) {
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}, {1, 0, 2}, {2, 0, 1}, {2, 1, 0}};
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (const int axis : kOrders[order]) {
    turn =
        Eigen::AngleAxisd(degrees[axis] * (std::numbers::pi / 180), Eigen::Vector3d::Unit(axis)) *
        turn;
  }
  return turn;
}

/// Mends what libassimp makes of two things: the place of a mesh in its node, by which it moves the
/// node's children too, and PostRotation, by which it follows a rotation where the format has the
/// inverse.
void FbxImport::add_lost_turns() {
  post_turned_.assign(scene_.nodes.size(), 0);
  std::map<std::string, int> uses;
  bool any = false;
  for (const FbxModel& model : models_) {
    if (!model.has_places()) {
      continue;
    }
    any = true;
    const auto found = node_by_name_.find(model.name);
    if (++uses[model.name] > 1 || found == node_by_name_.end()) {
      note(Severity::Warning, "fbx-places",
           "node " + in_quotes(model.name) +
               ", whose geometric transform or PostRotation cannot be told from another's",
           "give nodes names of their own, or export glTF");
      continue;
    }
    const auto n = static_cast<std::size_t>(found->second);
    if (model.has_geometric()) {
      Eigen::Affine3d place(Eigen::Translation3d(model.geometric_translation) *
                            turn_of_degrees(model.geometric_rotation));
      place.scale(model.geometric_scaling);
      // libassimp turns the mesh in the order of the node's own rotation, the format by x first.
      Eigen::Affine3d theirs(Eigen::Translation3d(model.geometric_translation) *
                             turn_of_degrees(model.geometric_rotation, model.rotation_order));
      theirs.scale(model.geometric_scaling);
      const Eigen::Matrix4d local = parent_from_node(scene_.nodes[n]) * theirs.matrix().inverse();
      if (!local.allFinite()) {
        fail("node " + in_quotes(model.name), "a geometric scaling of 0", "a mesh with a size");
      }
      set_transform(local, scene_.nodes[n]);
      geometric_[found->second] = place.matrix();
    }
    if (!model.post_rotation.isZero(0)) {
      GltfNode& node = scene_.nodes[n];
      post_turned_[n] = 1;
      if (node.matrix || model.pivots) {
        note(Severity::Warning, "fbx-places",
             "node " + in_quotes(node.name) + " has a PostRotation beside pivots or a shear",
             "it may be turned wrongly: freeze its transforms, or export glTF");
        continue;
      }
      const Eigen::Quaterniond back = turn_of_degrees(model.post_rotation).inverse();
      node.rotation = (Eigen::Quaterniond(node.rotation) * back * back).normalized().coeffs();
    }
  }
  if (any) {
    set_rest();
  }
}

void FbxImport::set_rest() {
  for (std::size_t n = 1; n < scene_.nodes.size(); ++n) {
    rest_[n] =
        rest_[static_cast<std::size_t>(scene_.nodes[n].parent)] * parent_from_node(scene_.nodes[n]);
  }
}

/// Mends what libassimp makes of InheritType: it multiplies matrices where a node leaves out its
/// parent's scale, or takes scales over after all rotations.
void FbxImport::add_kept_scales() {
  std::map<std::string, FbxInherit> said;
  for (const FbxModel& model : models_) {
    said.try_emplace(model.name, model.inherits);
  }
  std::vector<FbxInherit> inherits(scene_.nodes.size(), FbxInherit::Whole);
  own_scales_.assign(scene_.nodes.size(), Eigen::Vector3d::Ones());
  for (std::size_t n = 1; n < scene_.nodes.size(); ++n) {
    // Of several nodes of one name libassimp numbers all but the first: "arm001".
    const std::string name = nodes_[n - 1]->mName.C_Str();
    auto found = said.find(name);
    if (found == said.end() && name.size() > 3) {
      found = said.find(name.substr(0, name.size() - 3));
    }
    inherits[n] = found == said.end() ? FbxInherit::Whole : found->second;
  }
  scales_ = fbx_scales(scene_.nodes, inherits);
  const std::vector<GltfNode> given = scene_.nodes;
  for (std::size_t n = 1; n < scene_.nodes.size(); ++n) {
    const GltfNode& node = given[n];
    const FbxScale& scale = scales_[n];
    own_scales_[n] = node.scale;
    const bool sheared = given[static_cast<std::size_t>(node.parent)].matrix.has_value();
    const bool unknown = sheared && scale.apart && scale.from != scale.parent;
    if (scale.trivial() && !unknown) {
      continue;
    }
    const Eigen::Matrix3d turn = Eigen::Quaterniond(node.rotation).toRotationMatrix();
    Eigen::Matrix4d local = parent_from_node(node);
    local.topLeftCorner<3, 3>() = scale.undone.asDiagonal() * turn * scale.applied.asDiagonal();
    if (node.matrix || sheared || !local.allFinite()) {
      fail("node " + in_quotes(node.name),
           "a shear or a scale of 0 where it does not inherit its parent's scale",
           "transforms of rotations and scales: freeze them, or export glTF");
    }
    set_transform(local, scene_.nodes[n]);
  }
  set_rest();
}

Eigen::Matrix4d FbxImport::mesh_place(int node) const {
  const auto found = geometric_.find(node);
  return found == geometric_.end() ? Eigen::Matrix4d::Identity().eval() : found->second;
}

int FbxImport::node_of(const aiString& name) const {
  const auto found = node_by_name_.find(name.C_Str());
  if (found == node_by_name_.end()) {
    fail("bone " + in_quotes(name.C_Str()), "no node of that name", "a joint of the scene");
  }
  return found->second;
}

void FbxImport::add_static_meshes() {
  for (std::size_t n = 1; n < scene_.nodes.size(); ++n) {
    const aiNode& node = *nodes_[n - 1];
    GltfMesh mesh;
    mesh.name = scene_.nodes[n].name;
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      if (node.mMeshes[m] >= source_.mNumMeshes) {
        fail("node " + in_quotes(node.mName.C_Str()), "a mesh that is not there", "a sound file");
      }
      const aiMesh* part = source_.mMeshes[node.mMeshes[m]];
      if (part->mNumBones > 0) {
        skinned_.push_back({part, static_cast<int>(n)});
      } else {
        add_part({part, -1}, mesh, mesh_place(static_cast<int>(n)));
      }
    }
    if (!mesh.primitives.empty()) {
      scene_.nodes[n].mesh = static_cast<int>(scene_.meshes.size());
      scene_.meshes.push_back(std::move(mesh));
    }
  }
}

/// A primitive more; its blend shapes are those of its names that the mesh has already, or new
/// ones.
void FbxImport::add_part(const Place& place, GltfMesh& mesh,
                         const Eigen::Matrix4d& node_from_mesh) {
  std::vector<int> joint_of_bone;
  for (unsigned b = 0; place.node >= 0 && b < place.mesh->mNumBones; ++b) {
    joint_of_bone.push_back(slot_[static_cast<std::size_t>(node_of(place.mesh->mBones[b]->mName))]);
  }
  const Eigen::Matrix4d frame =
      place.node < 0 ? node_from_mesh : Eigen::Matrix4d(bound_place(place) * node_from_mesh);
  FbxPrimitive part = fbx_primitive(*place.mesh, frame, joint_of_bone, name_);
  if (part.left_out > 0) {
    note(Severity::Note, "fbx-faces",
         std::to_string(part.left_out) + " points, lines or triangles with an edge of length 0",
         "they were left out");
  }
  if (part.primitive.mesh.faces.rows() == 0) {
    return;
  }
  if (place.mesh->mMaterialIndex < source_.mNumMaterials) {
    part.primitive.material = utf8(source_.mMaterials[place.mesh->mMaterialIndex]->GetName());
  }
  add_shapes(part, mesh);
  mesh.primitives.push_back(std::move(part.primitive));
  for (GltfPrimitive& primitive : mesh.primitives) {
    primitive.targets.resize(mesh.target_names.size());
  }
}

/// Puts a primitive's blend shapes into the places that the mesh has for them, and gives the mesh
/// the weights at which they were saved.
void FbxImport::add_shapes(FbxPrimitive& part, GltfMesh& mesh) const {
  std::vector<GltfMorphTarget> targets(mesh.target_names.size());
  std::map<std::string, std::size_t> turns;
  for (std::size_t t = 0; t < part.target_names.size(); ++t) {
    const std::string shape = utf8(aiString(part.target_names[t]));
    const std::string& given = part.given_names[t];
    const double weight = shapes_.weight(given, turns[given]++);
    const auto known = std::find(mesh.target_names.begin(), mesh.target_names.end(), shape);
    const auto slot = static_cast<std::size_t>(known - mesh.target_names.begin());
    if (known == mesh.target_names.end()) {
      mesh.target_names.push_back(shape);
      mesh.weights.push_back(weight);
      targets.emplace_back();
    }
    if (!(mesh.weights[slot] == weight)) {
      fail("blend shape " + in_quotes(shape),
           "weights other than 0 in the saved file that cannot be told from one another",
           "all blend shapes at 0, or glTF");
    }
    targets[slot] = std::move(part.primitive.targets[t]);
  }
  part.primitive.targets = std::move(targets);
}

void FbxImport::find_joints() {
  slot_.assign(scene_.nodes.size(), -1);
  std::vector<int> seeds;
  for (const Place& place : skinned_) {
    for (unsigned b = 0; b < place.mesh->mNumBones; ++b) {
      seeds.push_back(node_of(place.mesh->mBones[b]->mName));
    }
  }
  for (unsigned a = 0; skinned_.empty() && a < source_.mNumAnimations; ++a) {
    for (unsigned c = 0; c < source_.mAnimations[a]->mNumChannels; ++c) {
      const auto found =
          node_by_name_.find(source_.mAnimations[a]->mChannels[c]->mNodeName.C_Str());
      if (found != node_by_name_.end()) {
        seeds.push_back(found->second);
      }
    }
  }
  if (seeds.empty()) {
    return;
  }
  std::sort(seeds.begin(), seeds.end());
  seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
  add_joints_between(seeds);
  if (std::cmp_greater(joints_.size(), limits_.joints)) {
    fail("", std::to_string(joints_.size()) + " joints",
         "at most " + std::to_string(limits_.joints));
  }
  set_bind_poses();
}

void FbxImport::add_joints_between(const std::vector<int>& seeds) {
  const std::size_t count = scene_.nodes.size();
  const auto parent = [&](std::size_t n) {
    return static_cast<std::size_t>(scene_.nodes[n].parent);
  };
  // Seeds at and below each node; the lowest node with all of them is above all.
  std::vector<std::size_t> below(count, 0);
  for (const int seed : seeds) {
    below[static_cast<std::size_t>(seed)] = 1;
  }
  std::vector<char> joint(count, 0);
  std::vector<char> mesh(count, 0);
  std::size_t top = 0;
  for (std::size_t n = count - 1; n > 0; --n) {
    top = below[n] == seeds.size() && top == 0 ? n : top;
    joint[n] = static_cast<char>(below[n] > 0);
    below[parent(n)] += below[n];
    mesh[n] = static_cast<char>(mesh[n] != 0 || nodes_[n - 1]->mNumMeshes > 0);
    mesh[parent(n)] = static_cast<char>(mesh[parent(n)] != 0 || mesh[n] != 0);
  }
  for (std::size_t n = 1; n < count; ++n) {
    if (n < top) {
      joint[n] = 0;  // above all of them, or beside
    } else if (joint[n] == 0 && mesh[n] == 0 && parent(n) > 0) {
      joint[n] = joint[parent(n)];  // the end of a limb
    }
  }
  for (std::size_t n = 1; n < count; ++n) {
    if (joint[n] != 0) {
      slot_[n] = static_cast<int>(joints_.size());
      joints_.push_back(static_cast<int>(n));
    }
  }
}

/// Where a mesh stood when it was bound, file's space from mesh: as its clusters say, which is not
/// where its node stands in a file that was saved in the middle of a motion; else its node.
Eigen::Matrix4d FbxImport::bound_place(const Place& place) const {
  const auto same = [](const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
    return (a - b).cwiseAbs().maxCoeff() <= kRounded * std::max(1.0, a.cwiseAbs().maxCoeff());
  };
  std::vector<Eigen::Matrix4d> places;  // that all bones allow; clusters may be alike by chance
  for (unsigned b = 0; b < place.mesh->mNumBones; ++b) {
    const Eigen::Matrix4d offset = matrix_of(place.mesh->mBones[b]->mOffsetMatrix);
    std::vector<Eigen::Matrix4d> here;
    for (const FbxBind& bind : binds_) {
      if (same(bind.joint_from_mesh, offset)) {
        here.push_back(bind.world_from_joint * bind.joint_from_mesh);
      }
    }
    if (b == 0) {
      places = here;
    }
    std::erase_if(places, [&](const Eigen::Matrix4d& one) {
      return std::none_of(here.begin(), here.end(),
                          [&](const Eigen::Matrix4d& other) { return same(one, other); });
    });
  }
  return places.empty() ? rest_[static_cast<std::size_t>(place.node)] : places.front();
}

void FbxImport::set_bind_poses() {
  bind_.resize(scene_.nodes.size());
  double apart = 0;
  double size = 0;
  for (const Place& place : skinned_) {
    const Eigen::Matrix4d mesh_place = bound_place(place);
    for (unsigned b = 0; b < place.mesh->mNumBones; ++b) {
      const aiBone& bone = *place.mesh->mBones[b];
      const Eigen::Matrix4d bind = mesh_place * matrix_of(bone.mOffsetMatrix).inverse();
      if (!bind.allFinite()) {
        fail("bone " + in_quotes(bone.mName.C_Str()), "a bind matrix without an inverse",
             "a rotation, a translation and one scale");
      }
      std::optional<Eigen::Matrix4d>& known = bind_[static_cast<std::size_t>(node_of(bone.mName))];
      if (known) {
        apart = std::max(apart, (*known - bind).cwiseAbs().maxCoeff());
      } else {
        known = bind;
      }
      size = std::max(size, known->topRightCorner<3, 1>().norm());
    }
  }
  if (apart > kAway * size) {
    note(Severity::Warning, "fbx-binds",
         "meshes that were bound to one joint in poses " + number_text(apart) + " units apart",
         "the pose of the first is taken for all");
  }
  std::vector<char> bound(scene_.nodes.size(), 0);
  for (const int j : joints_) {
    const auto n = static_cast<std::size_t>(j);
    const auto above = static_cast<std::size_t>(scene_.nodes[n].parent);
    bound[n] = static_cast<char>(bind_[n].has_value() || bound[above] != 0);
    if (!bind_[n]) {
      bind_[n] = bound[n] != 0 ? Eigen::Matrix4d(*bind_[above] * parent_from_node(scene_.nodes[n]))
                               : rest_[n];
    }
  }
  // Readers of skins place the whole body by its root: where a file was saved in the middle of a
  // motion, that would be in the root's pose of that moment.
  const auto root = static_cast<std::size_t>(joints_.front());
  if ((*bind_[root] - rest_[root]).cwiseAbs().maxCoeff() > kAway * std::max(size, 1e-9)) {
    const auto above = static_cast<std::size_t>(scene_.nodes[root].parent);
    const Eigen::Matrix4d local = rest_[above].inverse() * *bind_[root];
    if (local.allFinite()) {
      saved_root_ = scene_.nodes[root];
      set_transform(local, scene_.nodes[root]);
      note(Severity::Note, "fbx-pose",
           "the skeleton stands in another pose than the one in which its skin was bound",
           "the bind pose is the rest pose");
    }
  }
}

void FbxImport::add_skin() {
  GltfSkin skin;
  skin.name = scene_.nodes[static_cast<std::size_t>(joints_.front())].name;
  skin.joints = joints_;
  for (const int joint : joints_) {
    const Eigen::Matrix4d inverse = bind_[static_cast<std::size_t>(joint)]->inverse();
    if (!inverse.allFinite()) {
      fail("joint " + in_quotes(scene_.nodes[static_cast<std::size_t>(joint)].name),
           "a bind matrix without an inverse", "a rotation, a translation and one scale");
    }
    skin.inverse_binds.push_back(inverse);
    skin.inverse_binds.back().row(3) << 0, 0, 0, 1;
  }
  skin.dual_quaternions = shapes_.dual_quaternions();
  if (shapes_.unread_weights() && !skin.dual_quaternions) {
    note(Severity::Warning, "fbx-skin",
         "a skin that may mix linear blending and dual quaternions, by weights that are not read",
         "it is blended linearly, as skins of 3ds Max are; of Maya choose Classic Linear");
  }
  scene_.skins.push_back(std::move(skin));
  if (skinned_.empty()) {
    return;
  }
  GltfMesh mesh;
  std::string names;
  for (const Place& place : skinned_) {
    add_part(place, mesh, mesh_place(place.node));
    const std::string& name = scene_.nodes[static_cast<std::size_t>(place.node)].name;
    if (names.empty()) {
      mesh.name = name;
      names = name;
    } else if (!names.ends_with(name)) {
      names += ", " + name;
    }
  }
  if (mesh.primitives.empty()) {
    fail("mesh " + in_quotes(mesh.name), "no triangles", "a skinned mesh");
  }
  if (names != mesh.name) {
    note(Severity::Note, "fbx-meshes", "several meshes with a skin: " + names,
         "they are read as one body");
  }
  GltfNode node;
  node.name = mesh.name;
  node.parent = 0;
  node.mesh = static_cast<int>(scene_.meshes.size());
  node.skin = 0;
  scene_.meshes.push_back(std::move(mesh));
  scene_.nodes.push_back(std::move(node));
}

/// Keys with times that increase as floats, from `first` on.
template <class Key, class Values>
void add_channel(const Key* keys, unsigned count, double first, double rate, GltfPath path,
                 int node, const Values& values, GltfAnimation& animation) {
  GltfChannel channel;
  channel.node = node;
  channel.path = path;
  std::vector<unsigned> kept;
  float last = -1;
  for (unsigned k = 0; k < count; ++k) {
    const double time = std::max((keys[k].mTime - first) / rate, 0.0);
    if (static_cast<float>(time) > last) {
      last = static_cast<float>(time);
      channel.times.push_back(time);
      kept.push_back(k);
    }
  }
  if (kept.empty()) {
    return;
  }
  channel.values.resize(static_cast<Index>(kept.size()), path == GltfPath::Rotation ? 4 : 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    channel.values.row(static_cast<Index>(i)) = values(keys[kept[i]].mValue);
  }
  animation.channels.push_back(std::move(channel));
}

void FbxImport::add_animations() {
  for (unsigned a = 0; a < source_.mNumAnimations; ++a) {
    const aiAnimation& source = *source_.mAnimations[a];
    if (const int node = unscalable(source); node >= 0) {
      note(Severity::Warning, "fbx-scales",
           "animation " + in_quotes(utf8(source.mName)) + " moves node " +
               in_quotes(scene_.nodes[static_cast<std::size_t>(node)].name) +
               ", which does not inherit its parent's scale, and that changes or differs by axis",
           "the animation is left out: bake it with scales of 1 (Maya: without segment scale "
           "compensation), or export glTF");
      continue;
    }
    const double rate = source.mTicksPerSecond > 0 ? source.mTicksPerSecond : 1;
    double first = std::numeric_limits<double>::infinity();
    const auto earliest = [&first](const auto* keys, unsigned count) {
      if (count > 0) {
        first = std::min(first, keys[0].mTime);
      }
    };
    for (unsigned c = 0; c < source.mNumChannels; ++c) {
      earliest(source.mChannels[c]->mPositionKeys, source.mChannels[c]->mNumPositionKeys);
      earliest(source.mChannels[c]->mRotationKeys, source.mChannels[c]->mNumRotationKeys);
      earliest(source.mChannels[c]->mScalingKeys, source.mChannels[c]->mNumScalingKeys);
    }
    GltfAnimation animation;
    animation.name = utf8(source.mName);
    const auto vector = [](const aiVector3D& v) { return Eigen::RowVector3d(v.x, v.y, v.z); };
    const auto quaternion = [](const aiQuaternion& q) {
      return Eigen::RowVector4d(q.x, q.y, q.z, q.w).normalized().eval();
    };
    for (unsigned c = 0; c < source.mNumChannels; ++c) {
      const aiNodeAnim& channel = *source.mChannels[c];
      const auto found = node_by_name_.find(channel.mNodeName.C_Str());
      if (found == node_by_name_.end()) {
        continue;
      }
      const int node = found->second;
      scene_.nodes[static_cast<std::size_t>(node)].matrix.reset();  // no channel moves a matrix
      if (post_turned_[static_cast<std::size_t>(node)] != 0 && channel.mNumRotationKeys > 0) {
        note(Severity::Warning, "fbx-places",
             "node " + in_quotes(scene_.nodes[static_cast<std::size_t>(node)].name) +
                 " is animated and has a PostRotation",
             "its animation may be turned wrongly: bake it without, or export glTF");
      }
      add_channel(channel.mPositionKeys, channel.mNumPositionKeys, first, rate,
                  GltfPath::Translation, node, vector, animation);
      add_channel(channel.mRotationKeys, channel.mNumRotationKeys, first, rate, GltfPath::Rotation,
                  node, quaternion, animation);
      const FbxScale& scale = scales_[static_cast<std::size_t>(node)];
      const Eigen::RowVector3d kept = scale.undone[0] * scale.taken.transpose();
      add_channel(
          channel.mScalingKeys, channel.mNumScalingKeys, first, rate, GltfPath::Scale, node,
          [&](const aiVector3D& v) { return vector(v).cwiseProduct(kept).eval(); }, animation);
    }
    if (!animation.channels.empty() && add_root(animation)) {
      scene_.animations.push_back(std::move(animation));
    }
  }
}

/// A root that stands elsewhere than where it was bound, and that an animation does not move, is
/// where the file has it while that plays. False, with a finding, where no channel can say so.
bool FbxImport::add_root(GltfAnimation& animation) {
  const int root = joints_.empty() ? -1 : joints_.front();
  if (!saved_root_ || std::any_of(animation.channels.begin(), animation.channels.end(),
                                  [&](const GltfChannel& one) { return one.node == root; })) {
    return true;
  }
  if (saved_root_->matrix) {
    note(Severity::Warning, "fbx-scales",
         "animation " + in_quotes(animation.name) + " does not move the root, which shears",
         "the animation is left out: freeze the root's transform, or export glTF");
    return false;
  }
  const auto add = [&](GltfPath path, const Eigen::MatrixXd& value) {
    animation.channels.push_back({root, path, GltfInterpolation::Linear, {0}, value});
  };
  add(GltfPath::Translation, saved_root_->translation.transpose());
  add(GltfPath::Rotation, saved_root_->rotation.transpose());
  add(GltfPath::Scale, saved_root_->scale.transpose());
  return true;
}

/// The node for which an animation is left out (fbx_scales.h), or -1.
int FbxImport::unscalable(const aiAnimation& animation) const {
  std::vector<FbxScaleChange> changes(scene_.nodes.size(), FbxScaleChange::None);
  std::vector<char> moved(scene_.nodes.size(), 0);
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim& channel = *animation.mChannels[c];
    const auto found = node_by_name_.find(channel.mNodeName.C_Str());
    if (found == node_by_name_.end()) {
      continue;
    }
    const auto n = static_cast<std::size_t>(found->second);
    moved[n] = 1;
    for (unsigned k = 0; k < channel.mNumScalingKeys; ++k) {
      const aiVector3D& key = channel.mScalingKeys[k].mValue;
      const Eigen::Vector3d change =
          Eigen::Vector3d(key.x, key.y, key.z).cwiseQuotient(own_scales_[n]);
      if (!(change - Eigen::Vector3d::Ones()).isZero(kRounded)) {
        const bool even = change.isConstant(change[0], kRounded);
        changes[n] = std::max(changes[n], even ? FbxScaleChange::Even : FbxScaleChange::Uneven);
      }
    }
  }
  return unscalable_node(scales_, changes, moved);
}

}  // namespace

GltfScene import_fbx(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_TEXTURES, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_CAMERAS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_LIGHTS, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_REMOVE_EMPTY_BONES, false);
  const aiScene* scene =
      importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_Triangulate, "fbx");
  if (scene == nullptr) {
    const std::string error = importer.GetErrorString();
    throw DataError(name, "", complaint(error),
                    error.find("old format version") == std::string::npos
                        ? "a sound FBX file"
                        : "FBX 7.1 (2011) or later: save it again, or convert it by Blender");
  }
  return FbxImport(*scene, bytes, name, limits).scene();
}

}  // namespace atelier

#endif
