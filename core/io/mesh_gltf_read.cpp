#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/gltf_asset.h"
#include "core/io/gltf_buffers.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/io/mesh_gltf.h"
#include "core/io/polygon_mesh.h"
#include "core/io/text_scanner.h"
#include "core/io/text_writer.h"
#include "core/printable.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

/// Extensions that leave shapes and motion as they are, quantization, which any reader of all
/// component types understands, and meshopt's compression, which buffers undo.
bool is_known_extension(std::string_view name) {
  return name == "KHR_mesh_quantization" || name == "EXT_meshopt_compression" ||
         name == "KHR_meshopt_compression" || name == "KHR_lights_punctual" ||
         name == "KHR_texture_transform" || name == "KHR_texture_basisu" ||
         name == "EXT_texture_webp" || name == "EXT_texture_avif" || name == "KHR_xmp_json_ld" ||
         name.starts_with("KHR_materials_");
}

class GltfReader {
 public:
  GltfReader(const JsonPlace& root, const std::optional<std::span<const std::byte>>& binary,
             const std::optional<std::filesystem::path>& folder, const Limits& limits)
      : root_(root),
        materials_(root.items("materials")),
        buffers_(root, binary, folder, limits),
        limits_(limits) {}

  GltfScene read();

 private:
  void read_nodes();
  void read_scene();
  void read_meshes();
  std::optional<GltfPrimitive> read_primitive(const JsonPlace& place);
  Mesh read_attributes(const JsonPlace& attributes);
  template <class Rows>
  void check_coordinates(const Rows& rows, const JsonPlace& place) const;
  void read_influences(const JsonPlace& attributes, GltfPrimitive& primitive);
  GltfMorphTarget read_target(const JsonPlace& place, Index vertices);
  Triangles read_faces(const JsonPlace& place, int mode, Index vertices);
  void read_skins();
  void read_animations();
  GltfChannel read_channel(const JsonPlace& place, const std::vector<JsonPlace>& samplers);
  void check_uses();
  void leave_out_hidden_meshes();
  Index targets_of(int node) const;
  void note(const JsonPlace& place, const char* code, const std::string& what,
            Severity severity = Severity::Note) {
    scene_.findings.push_back({severity, code, root_.file() + ": " + place.where(), what, ""});
  }

  JsonPlace root_;
  std::vector<JsonPlace> materials_;
  GltfBuffers buffers_;
  Limits limits_;
  GltfScene scene_;
  std::int64_t vertices_ = 0;
  std::int64_t faces_ = 0;
};

void check_asset(const JsonPlace& root) {
  const std::string version = root.at("asset").at("version").text();
  if (!version.starts_with("2.")) {
    root.at("asset").at("version").fail(in_quotes(version), "2.0");
  }
  for (const JsonPlace& extension : root.items("extensionsRequired")) {
    if (!is_known_extension(extension.text())) {
      extension.fail("the extension " + in_quotes(extension.text()) + ", which is not supported",
                     "a file exported without it");
    }
  }
}

GltfScene GltfReader::read() {
  read_gltf_asset(root_.at("asset"), scene_);
  read_meshes();
  read_nodes();
  read_scene();
  read_skins();
  check_uses();
  read_animations();
  leave_out_hidden_meshes();
  return std::move(scene_);
}

Eigen::VectorXd fixed_numbers(const JsonPlace& place, std::size_t count) {
  const std::vector<double> numbers = place.numbers();
  if (numbers.size() != count) {
    place.fail(counted(static_cast<std::int64_t>(numbers.size()), "number"), std::to_string(count));
  }
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), static_cast<Index>(count));
}

/// 16 numbers by columns, the last row 0 0 0 1.
Eigen::Matrix4d affine(const Eigen::VectorXd& numbers, const JsonPlace& place) {
  Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(numbers.data());
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-4) {
    place.fail("a matrix whose last row is not 0 0 0 1", "an affine matrix");
  }
  return matrix;
}

template <class Rows>
void GltfReader::check_coordinates(const Rows& rows, const JsonPlace& place) const {
  const double most = rows.size() == 0 ? 0 : rows.cwiseAbs().maxCoeff();
  if (most > limits_.mesh_coordinate) {
    place.fail("coordinate " + number_text(most),
               "at most " + number_text(limits_.mesh_coordinate));
  }
}

void GltfReader::read_nodes() {
  const std::vector<JsonPlace> places = root_.items("nodes");
  scene_.nodes.resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const JsonPlace& place = places[i];
    GltfNode& node = scene_.nodes[i];
    node.name = place.text_or("name", "");
    node.mesh = static_cast<int>(place.integer_or("mesh", -1, 0, std::ssize(scene_.meshes) - 1));
    node.skin = static_cast<int>(place.integer_or("skin", -1, 0, limits_.mesh_faces));
    if (const auto matrix = place.find("matrix")) {
      node.matrix = affine(fixed_numbers(*matrix, 16), *matrix);
      check_coordinates(*node.matrix, *matrix);
    }
    if (const auto translation = place.find("translation")) {
      node.translation = fixed_numbers(*translation, 3);
      check_coordinates(node.translation, *translation);
    }
    if (const auto scale = place.find("scale")) {
      node.scale = fixed_numbers(*scale, 3);
      check_coordinates(node.scale, *scale);
    }
    if (const auto rotation = place.find("rotation")) {
      node.rotation = fixed_numbers(*rotation, 4);
      if (std::abs(node.rotation.norm() - 1) > 0.01) {
        rotation->fail("a quaternion of length " + short_number(node.rotation.norm(), 7), "1");
      }
      node.rotation.normalize();
    }
    if (const auto weights = place.find("weights")) {
      node.weights = weights->numbers();
    }
    for (const JsonPlace& child : place.items("children")) {
      const auto index = static_cast<std::size_t>(child.integer(0, std::ssize(places) - 1));
      if (scene_.nodes[index].parent >= 0 || index == i) {
        child.fail("node " + std::to_string(index) + ", which has a parent", "a tree");
      }
      scene_.nodes[index].parent = static_cast<int>(i);
    }
  }
  // One parent each is a forest or has a cycle; from a node in a cycle no way leads to a root.
  std::vector<char> reaches_root(places.size(), 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::vector<std::size_t> way;
    std::size_t at = i;
    while (reaches_root[at] == 0 && scene_.nodes[at].parent >= 0) {
      if (way.size() > places.size()) {
        places[i].fail("a node that is its own ancestor", "a tree");
      }
      way.push_back(at);
      at = static_cast<std::size_t>(scene_.nodes[at].parent);
    }
    reaches_root[at] = 1;
    for (const std::size_t passed : way) {
      reaches_root[passed] = 1;
    }
  }
}

void GltfReader::read_scene() {
  const std::vector<JsonPlace> scenes = root_.items("scenes");
  const int nodes = static_cast<int>(scene_.nodes.size());
  if (scenes.empty()) {
    for (int i = 0; i < nodes; ++i) {
      if (scene_.nodes[i].parent < 0) {
        scene_.roots.push_back(i);
      }
    }
    return;
  }
  const std::int64_t scene = root_.integer_or("scene", 0, 0, std::ssize(scenes) - 1);
  std::vector<char> listed(scene_.nodes.size(), 0);
  for (const JsonPlace& root : scenes[static_cast<std::size_t>(scene)].items("nodes")) {
    const int node = static_cast<int>(root.integer(0, nodes - 1));
    if (scene_.nodes[node].parent >= 0 || listed[node] != 0) {
      root.fail("node " + std::to_string(node) + ", which has a parent or is listed twice",
                "the root of a tree, once");
    }
    listed[node] = 1;
    scene_.roots.push_back(node);
  }
}

void GltfReader::read_meshes() {
  for (const JsonPlace& place : root_.items("meshes")) {
    GltfMesh mesh;
    mesh.name = place.text_or("name", "");
    for (const JsonPlace& primitive : place.at("primitives").items()) {
      std::optional<GltfPrimitive> read = read_primitive(primitive);
      if (!read) {
        continue;
      }
      if (!mesh.primitives.empty() &&
          mesh.primitives.front().targets.size() != read->targets.size()) {
        primitive.fail(
            std::to_string(read->targets.size()) + " morph targets",
            std::to_string(mesh.primitives.front().targets.size()) + " as in the first primitive");
      }
      mesh.primitives.push_back(std::move(*read));
    }
    const std::size_t targets = mesh.primitives.empty() ? 0 : mesh.primitives[0].targets.size();
    if (const auto weights = place.find("weights"); weights && !mesh.primitives.empty()) {
      const Eigen::VectorXd numbers = fixed_numbers(*weights, targets);
      mesh.weights.assign(numbers.begin(), numbers.end());
    }
    if (place.has("extras") && place.at("extras").has("targetNames")) {
      for (const JsonPlace& name : place.at("extras").items("targetNames")) {
        mesh.target_names.push_back(name.text());
      }
      if (mesh.target_names.size() != targets) {
        mesh.target_names.clear();
        note(place, "gltf-target-names", "not as many target names as targets; dropped");
      }
    }
    scene_.meshes.push_back(std::move(mesh));
  }
}

Mesh GltfReader::read_attributes(const JsonPlace& attributes) {
  Mesh mesh;
  const JsonPlace position = attributes.at("POSITION");
  mesh.vertices = buffers_.read(position, {"VEC3"}, limits_.mesh_vertices - vertices_);
  const Index count = mesh.vertices.rows();
  check_coordinates(mesh.vertices, position);
  vertices_ += count;
  const auto optional = [&](const char* name, std::initializer_list<std::string_view> types) {
    const auto place = attributes.find(name);
    Eigen::MatrixXd values =
        place ? buffers_.read(*place, types, limits_.mesh_vertices) : Eigen::MatrixXd();
    if (place && values.rows() != count) {
      place->fail(std::to_string(values.rows()) + " elements",
                  std::to_string(count) + " as POSITION");
    }
    return values;
  };
  if (const Eigen::MatrixXd normals = optional("NORMAL", {"VEC3"}); normals.rows() > 0) {
    mesh.normals = normals;
    if (!make_unit_rows(mesh.normals)) {
      mesh.normals.resize(0, 3);
      note(attributes, "gltf-normals", "some normals have no direction; all were dropped");
    }
  }
  if (const Eigen::MatrixXd uvs = optional("TEXCOORD_0", {"VEC2"}); uvs.rows() > 0) {
    mesh.uvs = uvs;
    check_coordinates(mesh.uvs, attributes.at("TEXCOORD_0"));
    mesh.uvs.col(1) = 1 - uvs.col(1).array();  // glTF counts v from the top
  }
  if (const Eigen::MatrixXd colors = optional("COLOR_0", {"VEC3", "VEC4"}); colors.rows() > 0) {
    mesh.colors = colors.leftCols(3).cwiseMax(0).cwiseMin(1).cast<float>();
  }
  return mesh;
}

void GltfReader::read_influences(const JsonPlace& attributes, GltfPrimitive& primitive) {
  const Index count = primitive.mesh.vertices.rows();
  for (int set = 0; set < 64; ++set) {
    const auto joints = attributes.find("JOINTS_" + std::to_string(set));
    const auto weights = attributes.find("WEIGHTS_" + std::to_string(set));
    if (joints.has_value() != weights.has_value()) {
      attributes.fail("JOINTS_" + std::to_string(set) + " or WEIGHTS_ alone", "both or none");
    }
    if (!joints) {
      break;
    }
    const Eigen::MatrixXi more_joints =
        buffers_.read_integers(*joints, "VEC4", limits_.mesh_vertices);
    const Eigen::MatrixXd more_weights = buffers_.read(*weights, {"VEC4"}, limits_.mesh_vertices);
    if (more_joints.rows() != count || more_weights.rows() != count) {
      joints->fail(std::to_string(more_joints.rows()) + " and " +
                       std::to_string(more_weights.rows()) + " elements",
                   std::to_string(count) + " as POSITION");
    }
    if (count > 0 && more_weights.minCoeff() < 0) {
      weights->fail("weight " + short_number(more_weights.minCoeff()), "0 or more");
    }
    const Index before = primitive.joints.cols();
    primitive.joints.conservativeResize(count, before + 4);
    primitive.weights.conservativeResize(count, before + 4);
    primitive.joints.rightCols(4) = more_joints;
    primitive.weights.rightCols(4) = more_weights;
  }
}

GltfMorphTarget GltfReader::read_target(const JsonPlace& place, Index vertices) {
  GltfMorphTarget target;
  const auto rows = [&](const JsonPlace& attribute) {
    Eigen::MatrixXd values = buffers_.read(attribute, {"VEC3"}, limits_.mesh_vertices);
    if (values.rows() != vertices) {
      attribute.fail(std::to_string(values.rows()) + " elements",
                     std::to_string(vertices) + " as POSITION");
    }
    return values;
  };
  if (const auto positions = place.find("POSITION")) {
    target.positions = rows(*positions);
    check_coordinates(target.positions, *positions);
  }
  if (const auto normals = place.find("NORMAL")) {
    target.normals = rows(*normals);
  }
  return target;
}

Triangles GltfReader::read_faces(const JsonPlace& place, int mode, Index vertices) {
  Eigen::VectorXi corners;
  if (const auto indices = place.find("indices")) {
    corners = buffers_.read_integers(*indices, "SCALAR", 3 * (limits_.mesh_faces - faces_));
    if (corners.size() > 0 && corners.maxCoeff() >= vertices) {
      indices->fail("index " + std::to_string(corners.maxCoeff()),
                    "below the " + std::to_string(vertices) + " of POSITION");
    }
  } else {
    corners.setLinSpaced(vertices, 0, static_cast<int>(vertices) - 1);
  }
  const Index count = corners.size();
  if (mode == 4 && count % 3 != 0) {
    place.fail(std::to_string(count) + " corners of triangles", "a multiple of 3");
  }
  if (count < 3) {
    return {};
  }
  Triangles faces(mode == 4 ? count / 3 : count - 2, 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    if (mode == 4) {
      faces.row(f) << corners[3 * f], corners[3 * f + 1], corners[3 * f + 2];
    } else if (mode == 5) {  // a strip turns every second triangle around
      faces.row(f) << corners[f], corners[f + 1 + f % 2], corners[f + 2 - f % 2];
    } else {
      faces.row(f) << corners[f + 1], corners[f + 2], corners[0];
    }
  }
  faces_ += faces.rows();
  if (faces_ > limits_.mesh_faces) {
    place.fail("more than " + std::to_string(limits_.mesh_faces) + " triangles", "a smaller scene");
  }
  return faces;
}

std::optional<GltfPrimitive> GltfReader::read_primitive(const JsonPlace& place) {
  const int mode = static_cast<int>(place.integer_or("mode", 4, 0, 6));
  if (mode < 4) {
    note(place, "gltf-primitive", "points or lines were skipped");
    return std::nullopt;
  }
  const JsonPlace attributes = place.at("attributes");
  if (!attributes.has("POSITION")) {
    note(place, "gltf-primitive", "a primitive without positions was skipped");
    return std::nullopt;
  }
  // By the standard an accessor without a buffer is all zeros; of a primitive that is compressed it
  // means that nothing else was kept.
  constexpr const char* kDraco = "KHR_draco_mesh_compression";
  const auto extensions = place.find("extensions");
  if (extensions && extensions->has(kDraco) && !buffers_.has_numbers(attributes.at("POSITION"))) {
    place.fail(std::string("a primitive that is compressed by ") + kDraco + " alone",
               "a file exported without it");
  }
  GltfPrimitive primitive;
  primitive.mesh = read_attributes(attributes);
  const Index vertices = primitive.mesh.vertices.rows();
  primitive.mesh.faces = read_faces(place, mode, vertices);
  if (primitive.mesh.uvs.rows() > 0) {
    primitive.mesh.uv_faces = primitive.mesh.faces;
  }
  read_influences(attributes, primitive);
  for (const JsonPlace& target : place.items("targets")) {
    primitive.targets.push_back(read_target(target, vertices));
  }
  if (const auto material = place.find("material")) {
    const std::int64_t index = material->integer(0, std::ssize(materials_) - 1);
    primitive.material = materials_[static_cast<std::size_t>(index)].text_or("name", "");
  }
  return primitive;
}

void GltfReader::read_skins() {
  for (const JsonPlace& place : root_.items("skins")) {
    GltfSkin skin;
    skin.name = place.text_or("name", "");
    const JsonPlace joints = place.at("joints");
    if (joints.size() == 0 || std::cmp_greater(joints.size(), limits_.joints)) {
      joints.fail(std::to_string(joints.size()) + " joints",
                  "1 to " + std::to_string(limits_.joints));
    }
    for (const JsonPlace& joint : joints.items()) {
      skin.joints.push_back(static_cast<int>(joint.integer(0, std::ssize(scene_.nodes) - 1)));
    }
    skin.inverse_binds.assign(skin.joints.size(), Eigen::Matrix4d::Identity());
    if (const auto binds = place.find("inverseBindMatrices")) {
      const Eigen::MatrixXd matrices = buffers_.read(*binds, {"MAT4"}, 16 * limits_.joints);
      if (std::cmp_less(matrices.rows(), skin.joints.size())) {
        binds->fail(std::to_string(matrices.rows()) + " matrices",
                    std::to_string(skin.joints.size()) + ", one a joint");
      }
      for (std::size_t j = 0; j < skin.joints.size(); ++j) {
        const Eigen::VectorXd row = matrices.row(static_cast<Index>(j));
        skin.inverse_binds[j] = affine(row, *binds);
      }
    }
    scene_.skins.push_back(std::move(skin));
  }
}

Index GltfReader::targets_of(int node) const {
  const int mesh = scene_.nodes[node].mesh;
  return mesh < 0 || scene_.meshes[mesh].primitives.empty()
             ? 0
             : std::ssize(scene_.meshes[mesh].primitives.front().targets);
}

/// The largest joint with a weight.
int last_joint(const GltfMesh& mesh) {
  int last = -1;
  for (const GltfPrimitive& primitive : mesh.primitives) {
    for (Index v = 0; v < primitive.joints.rows(); ++v) {
      for (Index k = 0; k < primitive.joints.cols(); ++k) {
        if (primitive.weights(v, k) > 0) {
          last = std::max(last, primitive.joints(v, k));
        }
      }
    }
  }
  return last;
}

/// Joints and weights that nodes say of their meshes and skins.
void GltfReader::check_uses() {
  const std::vector<JsonPlace> places = root_.items("nodes");
  std::vector<int> last_joints;
  for (const GltfMesh& mesh : scene_.meshes) {
    last_joints.push_back(last_joint(mesh));
  }
  for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
    const GltfNode& node = scene_.nodes[i];
    if (node.skin >= std::ssize(scene_.skins)) {
      places[i].fail("skin " + std::to_string(node.skin),
                     "one of " + std::to_string(scene_.skins.size()));
    }
    if (!node.weights.empty() && std::ssize(node.weights) != targets_of(static_cast<int>(i))) {
      places[i].fail(std::to_string(node.weights.size()) + " weights",
                     std::to_string(targets_of(static_cast<int>(i))) + ", one a morph target");
    }
    if (node.skin < 0 || node.mesh < 0) {
      continue;
    }
    const auto joints = static_cast<int>(scene_.skins[node.skin].joints.size());
    if (last_joints[node.mesh] >= joints) {
      places[i].fail("mesh " + std::to_string(node.mesh) + " with joint " +
                         std::to_string(last_joints[node.mesh]),
                     "below the " + std::to_string(joints) + " of the skin");
    }
  }
}

GltfChannel GltfReader::read_channel(const JsonPlace& place,
                                     const std::vector<JsonPlace>& samplers) {
  GltfChannel channel;
  const JsonPlace target = place.at("target");
  channel.node = static_cast<int>(target.at("node").integer(0, std::ssize(scene_.nodes) - 1));
  const JsonPlace path = target.at("path");
  const std::string& name = path.text();
  if (name == "translation") {
    channel.path = GltfPath::Translation;
  } else if (name == "rotation") {
    channel.path = GltfPath::Rotation;
  } else if (name == "scale") {
    channel.path = GltfPath::Scale;
  } else if (name == "weights") {
    channel.path = GltfPath::Weights;
  } else {
    path.fail(in_quotes(name), "translation, rotation, scale or weights");
  }
  const JsonPlace& sampler =
      samplers[static_cast<std::size_t>(place.at("sampler").integer(0, std::ssize(samplers) - 1))];
  const std::string interpolation = sampler.text_or("interpolation", "LINEAR");
  if (interpolation == "STEP") {
    channel.interpolation = GltfInterpolation::Step;
  } else if (interpolation == "CUBICSPLINE") {
    channel.interpolation = GltfInterpolation::CubicSpline;
  } else if (interpolation != "LINEAR") {
    sampler.fail("interpolation " + in_quotes(interpolation), "LINEAR, STEP or CUBICSPLINE");
  }
  const JsonPlace input = sampler.at("input");
  const Eigen::MatrixXd times = buffers_.read(input, {"SCALAR"}, limits_.frames);
  for (Index k = 0; k < times.rows(); ++k) {
    if (times(k, 0) < 0 || (k > 0 && times(k, 0) <= times(k - 1, 0))) {
      input.fail("time " + short_number(times(k, 0), 7) + " of key " + std::to_string(k),
                 "increasing times, from 0");
    }
    channel.times.push_back(times(k, 0));
  }
  if (channel.times.empty()) {
    input.fail("no keys", "at least one");
  }
  const Index keys = std::ssize(channel.times);
  const Index rows = channel.interpolation == GltfInterpolation::CubicSpline ? 3 * keys : keys;
  const JsonPlace output = sampler.at("output");
  const bool weights = channel.path == GltfPath::Weights;
  const Index width = weights ? targets_of(channel.node) : 0;
  if (weights && width == 0) {
    target.fail("weights of a node without morph targets", "a mesh with targets");
  }
  const char* type = weights ? "SCALAR" : channel.path == GltfPath::Rotation ? "VEC4" : "VEC3";
  const Eigen::MatrixXd values =
      buffers_.read(output, {type}, std::max<std::int64_t>(1, width) * 3 * limits_.frames);
  if (values.rows() != rows * std::max<Index>(1, width)) {
    output.fail(std::to_string(values.rows()) + " elements",
                std::to_string(rows * std::max<Index>(1, width)));
  }
  check_coordinates(values, output);
  channel.values = values;
  if (weights) {
    channel.values = values.reshaped<Eigen::RowMajor>(rows, width);
  }
  return channel;
}

/// KHR_node_visibility hides a node and all below it; EXT_mesh_gpu_instancing repeats a node's
/// mesh, which a Mesh of one place cannot.
void GltfReader::leave_out_hidden_meshes() {
  const std::vector<JsonPlace> places = root_.items("nodes");
  std::vector<int> hidden(places.size(), -1);  // 1: it or one above it is; -1: not known yet
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto extensions = places[i].find("extensions");
    if (!extensions) {
      continue;
    }
    const auto visibility = extensions->find("KHR_node_visibility");
    if (visibility && !visibility->boolean_or("visible", true)) {
      hidden[i] = 1;
    }
    if (scene_.nodes[i].mesh >= 0 && extensions->has("EXT_mesh_gpu_instancing")) {
      note(places[i], "gltf-instances",
           "a mesh that EXT_mesh_gpu_instancing repeats is read once, where its node stands",
           Severity::Warning);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    int top = static_cast<int>(i);  // the first of which it is known, going up, or the root
    while (hidden[top] < 0 && scene_.nodes[top].parent >= 0) {
      top = scene_.nodes[top].parent;
    }
    const int known = std::max(hidden[top], 0);
    for (int at = static_cast<int>(i); at >= 0 && hidden[at] < 0; at = scene_.nodes[at].parent) {
      hidden[at] = known;
    }
    if (known == 0 || scene_.nodes[i].mesh < 0) {
      continue;
    }
    note(places[i], "gltf-hidden", "a mesh that KHR_node_visibility hides is left out",
         Severity::Warning);
    scene_.nodes[i].mesh = -1;
    scene_.nodes[i].skin = -1;
    scene_.nodes[i].weights.clear();
    for (GltfAnimation& animation : scene_.animations) {
      std::erase_if(animation.channels, [i](const GltfChannel& channel) {
        return channel.node == static_cast<int>(i) && channel.path == GltfPath::Weights;
      });
    }
  }
}

void GltfReader::read_animations() {
  for (const JsonPlace& place : root_.items("animations")) {
    GltfAnimation animation;
    animation.name = place.text_or("name", "");
    const std::vector<JsonPlace> samplers = place.items("samplers");
    for (const JsonPlace& channel : place.items("channels")) {
      const JsonPlace target = channel.at("target");
      if (!target.has("node") || target.text_or("path", "") == "pointer") {
        note(channel, "gltf-channel", "a channel that moves no node was skipped");
        continue;
      }
      animation.channels.push_back(read_channel(channel, samplers));
    }
    scene_.animations.push_back(std::move(animation));
  }
}

GltfScene read(std::span<const std::byte> bytes, const std::string& name,
               const std::optional<std::filesystem::path>& folder, const Limits& limits) {
  if (std::cmp_greater(bytes.size(), limits.mesh_file_bytes)) {
    throw DataError(name, "", std::to_string(bytes.size()) + " bytes",
                    "at most " + std::to_string(limits.mesh_file_bytes));
  }
  const GltfChunks chunks = split_glb(bytes, name);
  // A data URI is one string: as long as the file may be.
  Limits text_limits = limits;
  text_limits.text_file_bytes = std::max(limits.text_file_bytes, std::int64_t{512} << 20);
  text_limits.text_string_bytes = text_limits.text_file_bytes;
  const nlohmann::json document = parse_json(chunks.json, name, text_limits);
  const JsonPlace root(document, name);
  check_asset(root);
  return GltfReader(root, chunks.binary, folder, limits).read();
}

}  // namespace

GltfScene read_gltf(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits) {
  return read(bytes, name, std::nullopt, limits);
}

GltfScene read_gltf(const std::filesystem::path& path, const Limits& limits) {
  return read(read_file_bytes(path, limits.mesh_file_bytes), path.string(), path.parent_path(),
              limits);
}

}  // namespace atelier
