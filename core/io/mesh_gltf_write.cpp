#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

#include <tiny_gltf.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/gltf_asset.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_gltf.h"
#include "core/io/to_float.h"

namespace atelier {
namespace {

/// Fills a tinygltf model whose only buffer grows by one view for each accessor.
class GltfWriter {
 public:
  explicit GltfWriter(const GltfScene& scene) : scene_(scene) {
    check_gltf(scene);
    model_.asset.version = "2.0";
    model_.asset.generator = "Atelier";
    model_.asset.copyright = gltf_copyright(scene.copyright, scene.consent);
    if (!scene.consent.empty()) {
      model_.asset.extras =
          tinygltf::Value(tinygltf::Value::Object{{"consent", tinygltf::Value(scene.consent)}});
    }
    model_.buffers.emplace_back();
    for (const GltfMesh& mesh : scene.meshes) {
      add_mesh(mesh);
    }
    add_nodes();
    for (const GltfSkin& skin : scene.skins) {
      add_skin(skin);
    }
    for (const GltfAnimation& animation : scene.animations) {
      add_animation(animation);
    }
    if (model_.buffers[0].data.empty()) {
      model_.buffers.clear();
    }
  }

  std::string text(bool binary) {
    std::ostringstream stream;
    stream.exceptions(std::ios::badbit);  // or it would swallow that memory runs out
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model_, stream, !binary, binary)) {
      throw EnvironmentError("tinygltf", "cannot write the scene");
    }
    return std::move(stream).str();
  }

 private:
  template <class T>
  int add(const std::vector<T>& numbers, std::size_t count, int type, int target) {
    std::vector<unsigned char>& data = model_.buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = numbers.size() * sizeof(T);
    view.target = target;
    const auto* bytes = reinterpret_cast<const unsigned char*>(numbers.data());
    data.insert(data.end(), bytes, bytes + view.byteLength);
    data.resize((data.size() + 3) / 4 * 4);
    model_.bufferViews.push_back(view);
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model_.bufferViews.size()) - 1;
    accessor.count = count;
    accessor.type = type;
    accessor.componentType =
        std::is_same_v<T, float>           ? TINYGLTF_COMPONENT_TYPE_FLOAT
        : std::is_same_v<T, std::uint8_t>  ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE
        : std::is_same_v<T, std::uint16_t> ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT
                                           : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  /// Rows as floats. `bounded`: with least and greatest, as glTF wants of positions and times.
  template <class Rows>
  int add_rows(const Rows& rows, int type, int target, bool bounded = false) {
    std::vector<float> numbers;
    numbers.reserve(static_cast<std::size_t>(rows.size()));
    for (Index i = 0; i < rows.rows(); ++i) {
      for (Index c = 0; c < rows.cols(); ++c) {
        numbers.push_back(to_float(rows(i, c), "a mesh with a number"));
      }
    }
    const auto columns = static_cast<std::size_t>(rows.cols());
    const int index = add(numbers, static_cast<std::size_t>(rows.rows()), type, target);
    for (std::size_t c = 0; bounded && rows.rows() > 0 && c < columns; ++c) {
      float least = numbers[c];
      float greatest = numbers[c];
      for (std::size_t i = c; i < numbers.size(); i += columns) {
        least = std::min(least, numbers[i]);
        greatest = std::max(greatest, numbers[i]);
      }
      model_.accessors[index].minValues.push_back(static_cast<double>(least));
      model_.accessors[index].maxValues.push_back(static_cast<double>(greatest));
    }
    return index;
  }

  void add_mesh(const GltfMesh& mesh);
  void add_material(const std::string& name);
  tinygltf::Primitive primitive_of(const GltfPrimitive& source);
  void add_nodes();
  void add_skin(const GltfSkin& skin);
  void add_animation(const GltfAnimation& animation);

  const GltfScene& scene_;
  tinygltf::Model model_;
  std::map<std::string, int> materials_;
  std::vector<int> written_meshes_;  // of the scene's meshes, -1: left out
};

template <class Rows>
Rows gathered(const Rows& rows, const std::vector<int>& from) {
  Rows result(static_cast<Index>(from.size()), rows.cols());
  for (std::size_t i = 0; i < from.size(); ++i) {
    result.row(static_cast<Index>(i)) = rows.row(from[i]);
  }
  return result;
}

/// glTF wants unit normals: up where there is none, as at vertices without a face.
Points unit_rows(const Points& normals) {
  constexpr double kRounded = 1e-3;  // what is as near to 1 stays as it is
  Points unit = normals;
  for (Index v = 0; v < unit.rows(); ++v) {
    const double length = unit.row(v).norm();
    if (std::abs(length - 1) > kRounded) {
      unit.row(v) = length > 0 ? Eigen::RowVector3d(unit.row(v) / length)
                               : Eigen::RowVector3d(Eigen::RowVector3d::UnitY());
    }
  }
  return unit;
}

/// The same primitive with one texture coordinate a vertex: vertices that have several are doubled,
/// those that no face uses go.
GltfPrimitive split_at_seams(const GltfPrimitive& source) {
  const Mesh& mesh = source.mesh;
  GltfPrimitive split = source;
  if (mesh.uv_faces.rows() == 0) {
    split.mesh.uvs.resize(0, 2);
    return split;
  }
  if (mesh.uv_faces == mesh.faces && mesh.uvs.rows() == mesh.vertices.rows()) {
    return split;
  }
  std::map<std::pair<int, int>, int> index_of;
  std::vector<int> vertex_from;
  std::vector<int> uv_from;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const std::pair<int, int> key(mesh.faces(f, c), mesh.uv_faces(f, c));
      const auto [place, fresh] = index_of.try_emplace(key, static_cast<int>(vertex_from.size()));
      if (fresh) {
        vertex_from.push_back(key.first);
        uv_from.push_back(key.second);
      }
      split.mesh.faces(f, c) = place->second;
    }
  }
  const auto gather = [&](auto& rows) {
    if (rows.rows() > 0) {
      rows = gathered(rows, vertex_from);
    }
  };
  gather(split.mesh.vertices);
  gather(split.mesh.normals);
  gather(split.mesh.colors);
  gather(split.joints);
  gather(split.weights);
  for (GltfMorphTarget& target : split.targets) {
    gather(target.positions);
    gather(target.normals);
  }
  split.mesh.uvs = gathered(mesh.uvs, uv_from);
  split.mesh.uv_faces = split.mesh.faces;
  return split;
}

tinygltf::Primitive GltfWriter::primitive_of(const GltfPrimitive& unsplit) {
  check_mesh(unsplit.mesh);
  const GltfPrimitive source = split_at_seams(unsplit);
  constexpr int kVertices = TINYGLTF_TARGET_ARRAY_BUFFER;
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.attributes["POSITION"] =
      add_rows(source.mesh.vertices, TINYGLTF_TYPE_VEC3, kVertices, true);
  if (source.mesh.normals.rows() > 0) {
    primitive.attributes["NORMAL"] =
        add_rows(unit_rows(source.mesh.normals), TINYGLTF_TYPE_VEC3, kVertices);
  }
  if (source.mesh.uvs.rows() > 0) {
    Points2 uvs = source.mesh.uvs;
    uvs.col(1) = 1 - uvs.col(1).array();
    primitive.attributes["TEXCOORD_0"] = add_rows(uvs, TINYGLTF_TYPE_VEC2, kVertices);
  }
  if (source.mesh.colors.rows() > 0) {
    primitive.attributes["COLOR_0"] = add_rows(source.mesh.colors, TINYGLTF_TYPE_VEC3, kVertices);
  }
  for (Index set = 0; 4 * set < source.joints.cols(); ++set) {
    const std::string suffix = std::to_string(set);
    // Padding may name any joint; with no weight it names the first.
    std::vector<std::uint16_t> joints;
    for (Index v = 0; v < source.joints.rows(); ++v) {
      for (Index k = 4 * set; k < 4 * set + 4; ++k) {
        joints.push_back(source.weights(v, k) > 0 ? static_cast<std::uint16_t>(source.joints(v, k))
                                                  : 0);
      }
    }
    const auto count = static_cast<std::size_t>(source.joints.rows());
    const bool bytes = std::all_of(joints.begin(), joints.end(), [](int j) { return j < 256; });
    primitive.attributes["JOINTS_" + suffix] =
        bytes ? add(std::vector<std::uint8_t>(joints.begin(), joints.end()), count,
                    TINYGLTF_TYPE_VEC4, kVertices)
              : add(joints, count, TINYGLTF_TYPE_VEC4, kVertices);
    primitive.attributes["WEIGHTS_" + suffix] =
        add_rows(source.weights.middleCols(4 * set, 4), TINYGLTF_TYPE_VEC4, kVertices);
  }
  for (const GltfMorphTarget& target : source.targets) {
    std::map<std::string, int> attributes;
    const Points zero = Points::Zero(source.mesh.vertices.rows(), 3);
    attributes["POSITION"] = add_rows(target.positions.rows() > 0 ? target.positions : zero,
                                      TINYGLTF_TYPE_VEC3, kVertices, true);
    if (target.normals.rows() > 0) {
      attributes["NORMAL"] = add_rows(target.normals, TINYGLTF_TYPE_VEC3, kVertices);
    }
    primitive.targets.push_back(std::move(attributes));
  }
  if (source.mesh.faces.rows() > 0) {
    const std::vector<std::uint32_t> corners(source.mesh.faces.data(),
                                             source.mesh.faces.data() + source.mesh.faces.size());
    primitive.indices =
        add(corners, corners.size(), TINYGLTF_TYPE_SCALAR, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  }
  const auto [place, fresh] =
      materials_.try_emplace(source.material, static_cast<int>(materials_.size()));
  if (fresh) {
    add_material(source.material);
  }
  primitive.material = place->second;
  return primitive;
}

void GltfWriter::add_material(const std::string& name) {
  tinygltf::Material material;
  material.name = name;
  material.doubleSided = true;
  material.pbrMetallicRoughness.metallicFactor = 0;
  for (const GltfMaterial& look : scene_.materials) {
    if (look.name != name) {
      continue;
    }
    tinygltf::PbrMetallicRoughness& surface = material.pbrMetallicRoughness;
    surface.baseColorFactor = {look.color.x(), look.color.y(), look.color.z(), 1};
    if (!look.texture.empty()) {
      std::vector<unsigned char>& data = model_.buffers[0].data;
      tinygltf::BufferView view;
      view.buffer = 0;
      view.byteOffset = data.size();
      view.byteLength = look.texture.size();
      const auto* bytes = reinterpret_cast<const unsigned char*>(look.texture.data());
      data.insert(data.end(), bytes, bytes + look.texture.size());
      data.resize((data.size() + 3) / 4 * 4);
      model_.bufferViews.push_back(view);
      tinygltf::Image image;
      image.bufferView = static_cast<int>(model_.bufferViews.size()) - 1;
      image.mimeType = "image/png";
      model_.images.push_back(std::move(image));
      tinygltf::Texture texture;
      texture.source = static_cast<int>(model_.images.size()) - 1;
      model_.textures.push_back(texture);
      surface.baseColorTexture.index = static_cast<int>(model_.textures.size()) - 1;
    }
  }
  model_.materials.push_back(std::move(material));
}

void GltfWriter::add_mesh(const GltfMesh& source) {
  if (source.primitives.empty()) {
    written_meshes_.push_back(-1);  // glTF has no empty meshes
    return;
  }
  written_meshes_.push_back(static_cast<int>(model_.meshes.size()));
  tinygltf::Mesh mesh;
  mesh.name = source.name;
  for (const GltfPrimitive& primitive : source.primitives) {
    mesh.primitives.push_back(primitive_of(primitive));
  }
  mesh.weights = source.weights;
  if (!source.target_names.empty()) {
    tinygltf::Value::Array names;
    for (const std::string& name : source.target_names) {
      names.emplace_back(name);
    }
    mesh.extras = tinygltf::Value(tinygltf::Value::Object{{"targetNames", tinygltf::Value(names)}});
  }
  model_.meshes.push_back(std::move(mesh));
}

void GltfWriter::add_nodes() {
  for (const GltfNode& source : scene_.nodes) {
    tinygltf::Node node;
    node.name = source.name;
    node.mesh = source.mesh < 0 ? -1 : written_meshes_[source.mesh];
    if (node.mesh >= 0) {
      node.skin = source.skin;
      node.weights = source.weights;
    }
    if (source.matrix) {
      node.matrix.assign(source.matrix->data(), source.matrix->data() + 16);
    } else {
      node.translation.assign(source.translation.begin(), source.translation.end());
      node.rotation.assign(source.rotation.begin(), source.rotation.end());
      node.scale.assign(source.scale.begin(), source.scale.end());
    }
    model_.nodes.push_back(std::move(node));
  }
  for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
    if (scene_.nodes[i].parent >= 0) {
      model_.nodes[scene_.nodes[i].parent].children.push_back(static_cast<int>(i));
    }
  }
  model_.scenes.emplace_back().nodes = scene_.roots;
  model_.defaultScene = 0;
}

void GltfWriter::add_skin(const GltfSkin& source) {
  tinygltf::Skin skin;
  skin.name = source.name;
  skin.joints = source.joints;
  Eigen::MatrixXd rows(std::ssize(source.joints), 16);
  for (std::size_t j = 0; j < source.joints.size(); ++j) {
    rows.row(static_cast<Index>(j)) = source.inverse_binds[j].reshaped().transpose();
  }
  skin.inverseBindMatrices = add_rows(rows, TINYGLTF_TYPE_MAT4, 0);
  model_.skins.push_back(std::move(skin));
}

void GltfWriter::add_animation(const GltfAnimation& source) {
  static constexpr const char* kPaths[] = {"translation", "rotation", "scale", "weights"};
  static constexpr const char* kInterpolations[] = {"STEP", "LINEAR", "CUBICSPLINE"};
  tinygltf::Animation animation;
  animation.name = source.name;
  for (const GltfChannel& channel : source.channels) {
    tinygltf::AnimationSampler sampler;
    sampler.input =
        add_rows(Eigen::Map<const Eigen::VectorXd>(channel.times.data(), std::ssize(channel.times)),
                 TINYGLTF_TYPE_SCALAR, 0, true);
    if (channel.path == GltfPath::Weights) {
      const Eigen::VectorXd flat = channel.values.reshaped<Eigen::RowMajor>();
      sampler.output = add_rows(flat, TINYGLTF_TYPE_SCALAR, 0);
    } else {
      sampler.output =
          add_rows(channel.values,
                   channel.path == GltfPath::Rotation ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3, 0);
    }
    sampler.interpolation = kInterpolations[static_cast<int>(channel.interpolation)];
    tinygltf::AnimationChannel target;
    target.sampler = static_cast<int>(animation.samplers.size());
    target.target_node = channel.node;
    target.target_path = kPaths[static_cast<int>(channel.path)];
    animation.samplers.push_back(std::move(sampler));
    animation.channels.push_back(std::move(target));
  }
  model_.animations.push_back(std::move(animation));
}

}  // namespace

std::string glb_bytes(const GltfScene& scene) {
  return GltfWriter(scene).text(true);
}

void write_gltf(const std::filesystem::path& path, const GltfScene& scene) {
  const std::string extension = lower_extension(path);
  ATELIER_CHECK(extension == ".glb" || extension == ".gltf",
                "no glTF extension in '" + path.string() + "'");
  write_file_atomically(path, GltfWriter(scene).text(extension == ".glb"));
}

}  // namespace atelier
