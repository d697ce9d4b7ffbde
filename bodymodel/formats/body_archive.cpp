#include "bodymodel/formats/body_archive.h"

#include <span>

#include "core/check_bounded.h"
#include "core/error.h"
#include "core/io/npz.h"

namespace atelier {
namespace {

using Arrays = std::map<std::string, Tensor>;
using Shape = std::vector<std::int64_t>;

constexpr const char* kBodySchema = "atelier-body-1";
constexpr const char* kMotionSchema = "atelier-motion-1";

Tensor text_tensor(std::vector<std::string> strings) {
  Tensor tensor{ElementType::Text, {static_cast<std::int64_t>(strings.size())}, {}, {}};
  tensor.strings = std::move(strings);
  return tensor;
}

template <class Matrix>
Tensor matrix_tensor(const Matrix& matrix) {
  using Number = typename Matrix::Scalar;
  return tensor_of<Number>(
      std::span<const Number>(matrix.data(), static_cast<std::size_t>(matrix.size())),
      {matrix.rows(), matrix.cols()});
}

template <class T>
Tensor list_tensor(const std::vector<T>& values) {
  return tensor_of<T>(std::span<const T>(values), {static_cast<std::int64_t>(values.size())});
}

// Blendshapes one after the other; a dense one has no list of vertices, which -1 says.
void add_surfaces(const std::string& name, const std::vector<const Blendshape*>& shapes,
                  Arrays& arrays) {
  std::vector<std::int64_t> starts = {0};
  std::vector<int> vertices;
  Index rows = 0;
  for (const Blendshape* shape : shapes) {
    rows += shape->offsets.rows();
  }
  Points offsets(rows, 3);
  rows = 0;
  for (const Blendshape* shape : shapes) {
    const Index count = shape->offsets.rows();
    offsets.middleRows(rows, count) = shape->offsets;
    rows += count;
    for (Index i = 0; i < count; ++i) {
      vertices.push_back(shape->vertices.empty() ? -1
                                                 : shape->vertices[static_cast<std::size_t>(i)]);
    }
    starts.push_back(rows);
  }
  arrays[name + "_starts"] = list_tensor(starts);
  arrays[name + "_vertices"] = list_tensor(vertices);
  arrays[name + "_offsets"] = matrix_tensor(offsets);
}

void add_skeleton(const Skeleton& skeleton, Arrays& arrays) {
  arrays["joint_names"] = text_tensor(skeleton.names);
  arrays["parents"] = list_tensor(skeleton.parents);
  arrays["offsets"] = matrix_tensor(skeleton.offsets);
  arrays["rest_rotations"] = matrix_tensor(skeleton.rest_rotations);
  arrays["limits_min"] = matrix_tensor(skeleton.limits_min);
  arrays["limits_max"] = matrix_tensor(skeleton.limits_max);
}

// Reads arrays by name; every error names one.
class BodyArrayReader {
 public:
  BodyArrayReader(const Npz& npz, double most) : npz_(npz), most_(most) {}

  [[noreturn]] void fail(const std::string& name, const std::string& found,
                         const std::string& expected) const {
    throw DataError(npz_.file(), "array '" + name + "'", found, expected);
  }

  Tensor tensor(const std::string& name) const {
    if (!npz_.contains(name)) {
      fail(name, "missing", "an array of that name");
    }
    return npz_.read(name);
  }

  std::vector<std::string> strings(const std::string& name) const {
    const Tensor t = tensor(name);
    if (t.type != ElementType::Text && element_count(t) == 0) {
      return {};  // an empty list of names has no type of its own
    }
    if (t.type != ElementType::Text || t.shape.size() != 1) {
      fail(name, element_type_name(t.type) + shape_text(t.shape), "a list of names");
    }
    return t.strings;
  }

  std::vector<int> integers(const std::string& name) const {
    std::vector<int> values;
    for (const std::int64_t value : integers_of(tensor(name), npz_.file(), name)) {
      if (value < -2'147'483'647 || value > 2'147'483'647) {
        fail(name, std::to_string(value), "numbers of 32 bits");
      }
      values.push_back(static_cast<int>(value));
    }
    return values;
  }

  std::vector<double> numbers(const std::string& name) const {
    const Tensor t = tensor(name);
    check_bounded(t, most_, npz_.file(), name);
    return doubles_of(t, npz_.file(), name);
  }

  // Empty arrays may have any shape.
  RowMatrix matrix(const std::string& name, Index columns) const {
    const Tensor t = tensor(name);
    if (element_count(t) == 0) {
      return RowMatrix(0, columns < 0 ? 0 : columns);
    }
    check_bounded(t, most_, npz_.file(), name);
    return matrix_of(t, columns, npz_.file(), name);
  }

  Triangles triangles(const std::string& name) const {
    const std::vector<int> values = integers(name);
    if (values.size() % 3 != 0) {
      fail(name, std::to_string(values.size()) + " numbers", "three for each face");
    }
    Triangles faces(static_cast<Index>(values.size() / 3), 3);
    std::copy(values.begin(), values.end(), faces.data());
    return faces;
  }

  // [N+1] increasing from 0 to `count`.
  std::vector<int> starts(const std::string& name, std::size_t rows, std::size_t count) const {
    std::vector<int> values = integers(name);
    bool good = values.size() == rows + 1 && values.front() == 0 &&
                values.back() == static_cast<int>(count);
    for (std::size_t i = 1; good && i < values.size(); ++i) {
      good = values[i] >= values[i - 1];
    }
    if (!good) {
      fail(name, std::to_string(values.size()) + " numbers",
           std::to_string(rows + 1) + " increasing ones from 0 to " + std::to_string(count));
    }
    return values;
  }

  std::vector<Blendshape> surfaces(const std::string& name, std::size_t rows) const {
    const std::vector<int> vertices = integers(name + "_vertices");
    const Points offsets = matrix(name + "_offsets", 3);
    if (offsets.rows() != static_cast<Index>(vertices.size())) {
      fail(name + "_offsets", std::to_string(offsets.rows()) + " rows",
           std::to_string(vertices.size()) + ", as '" + name + "_vertices' has");
    }
    const std::vector<int> begin = starts(name + "_starts", rows, vertices.size());
    std::vector<Blendshape> shapes(rows);
    for (std::size_t s = 0; s < rows; ++s) {
      const Index count = begin[s + 1] - begin[s];
      shapes[s].offsets = offsets.middleRows(begin[s], count);
      if (count > 0 && vertices[static_cast<std::size_t>(begin[s])] >= 0) {
        shapes[s].vertices.assign(vertices.begin() + begin[s], vertices.begin() + begin[s + 1]);
      }
    }
    return shapes;
  }

  Skeleton skeleton() const {
    Skeleton result;
    result.names = strings("joint_names");
    result.parents = integers("parents");
    result.offsets = matrix("offsets", 3);
    result.rest_rotations = matrix("rest_rotations", 3);
    result.limits_min = matrix("limits_min", 3);
    result.limits_max = matrix("limits_max", 3);
    return result;
  }

 private:
  const Npz& npz_;
  double most_;  // of every number
};

void expect_schema(const Npz& npz, const char* schema) {
  const std::string found = archive_schema(npz);
  if (found != schema) {
    throw DataError(npz.file(), "array 'schema'",
                    found.empty() ? "missing" : "'" + found.substr(0, 40) + "'",
                    std::string("'") + schema + "'");
  }
}

// Unit and axes: a file in another unit or with another axis up is not taken as metres.
void expect_frame(const BodyArrayReader& reader) {
  const std::pair<const char*, const char*> words[] = {{"unit", "m"}, {"up", "y"}};
  for (const auto& [name, word] : words) {
    const std::vector<std::string> found = reader.strings(name);
    if (found.size() != 1 || found[0] != word) {
      reader.fail(name, found.empty() ? "nothing" : "'" + found[0].substr(0, 20) + "'",
                  std::string("'") + word +
                      "': archives are in metres, Y up; turn the numbers before writing one");
    }
  }
}

void read_shapes(const BodyArrayReader& reader, BodyModel& model) {
  const std::vector<std::string> names = reader.strings("shape_names");
  const std::vector<std::string> units = reader.strings("shape_units");
  const RowMatrix ranges = reader.matrix("shape_ranges", 3);
  const std::vector<double> joints = reader.numbers("shape_joints");
  const std::size_t block = 3 * static_cast<std::size_t>(model.skeleton.names.size());
  if (units.size() != names.size() || ranges.rows() != static_cast<Index>(names.size()) ||
      joints.size() != names.size() * block) {
    reader.fail("shape_names", std::to_string(names.size()) + " names",
                "as many units, ranges and joint offsets");
  }
  std::vector<Blendshape> surfaces = reader.surfaces("shape", names.size());
  for (std::size_t s = 0; s < names.size(); ++s) {
    const Index row = static_cast<Index>(s);
    model.shape.push_back(
        {names[s], units[s], ranges(row, 0), ranges(row, 1), ranges(row, 2), std::move(surfaces[s]),
         Eigen::Map<const Points>(joints.data() + s * block, static_cast<Index>(block / 3), 3)});
  }
}

void read_correctives(const BodyArrayReader& reader, BodyModel& model) {
  const std::vector<int> features = reader.integers("corrective_features");
  const RowMatrix axes = reader.matrix("corrective_axes", 3);
  if (features.size() % 3 != 0 || axes.rows() != static_cast<Index>(features.size() / 3)) {
    reader.fail("corrective_features", std::to_string(features.size()) + " numbers",
                "three for each corrective, and an axis");
  }
  std::vector<Blendshape> surfaces = reader.surfaces("corrective", features.size() / 3);
  for (std::size_t c = 0; c < surfaces.size(); ++c) {
    const int feature = features[3 * c + 1];
    if (feature < 0 || feature > 2) {
      reader.fail("corrective_features", "feature " + std::to_string(feature), "0, 1 or 2");
    }
    model.correctives.push_back({features[3 * c], static_cast<PoseFeature>(feature),
                                 features[3 * c + 2], axes.row(static_cast<Index>(c)).transpose(),
                                 std::move(surfaces[c])});
  }
}

void read_skin(const BodyArrayReader& reader, BodyModel& model) {
  model.skin.weights = reader.matrix("skin_weights", -1);
  const std::vector<int> skin_joints = reader.integers("skin_joints");
  if (static_cast<Index>(skin_joints.size()) != model.skin.weights.size()) {
    reader.fail("skin_joints", std::to_string(skin_joints.size()) + " numbers",
                std::to_string(model.skin.weights.size()) + ", as 'skin_weights' has");
  }
  model.skin.joints.resize(model.skin.weights.rows(), model.skin.weights.cols());
  std::copy(skin_joints.begin(), skin_joints.end(), model.skin.joints.data());
}

void read_regressor(const BodyArrayReader& reader, BodyModel& model) {
  const std::vector<int> regressor_vertices = reader.integers("regressor_vertices");
  const std::vector<double> regressor_weights = reader.numbers("regressor_weights");
  if (regressor_weights.size() != regressor_vertices.size()) {
    reader.fail("regressor_weights", std::to_string(regressor_weights.size()) + " numbers",
                std::to_string(regressor_vertices.size()) + ", as 'regressor_vertices' has");
  }
  if (!regressor_vertices.empty()) {
    const std::vector<int> begin =
        reader.starts("regressor_starts", model.skeleton.names.size(), regressor_vertices.size());
    for (std::size_t j = 0; j + 1 < begin.size(); ++j) {
      model.regressor.push_back(
          {{regressor_vertices.begin() + begin[j], regressor_vertices.begin() + begin[j + 1]},
           {regressor_weights.begin() + begin[j], regressor_weights.begin() + begin[j + 1]}});
    }
  }
}

void read_groups(const BodyArrayReader& reader, BodyModel& model) {
  const std::vector<std::string> group_names = reader.strings("group_names");
  const std::vector<int> group_vertices = reader.integers("group_vertices");
  const std::vector<int> begin =
      reader.starts("group_starts", group_names.size(), group_vertices.size());
  for (std::size_t g = 0; g < group_names.size(); ++g) {
    model.groups.push_back(
        {group_names[g],
         {group_vertices.begin() + begin[g], group_vertices.begin() + begin[g + 1]}});
  }
}

}  // namespace

std::string archive_schema(const Npz& npz) {
  if (!npz.contains("schema")) {
    return "";
  }
  const Tensor tensor = npz.read("schema");
  return tensor.type == ElementType::Text && tensor.strings.size() == 1 ? tensor.strings[0] : "";
}

std::map<std::string, Tensor> body_arrays(const BodyModel& model) {
  check_body_model(model);
  Arrays arrays;
  arrays["schema"] = text_tensor({kBodySchema});
  arrays["name"] = text_tensor({model.name});
  arrays["unit"] = text_tensor({"m"});
  arrays["up"] = text_tensor({"y"});
  add_skeleton(model.skeleton, arrays);
  arrays["vertices"] = matrix_tensor(model.mesh.vertices);
  arrays["faces"] = matrix_tensor(model.mesh.faces);
  arrays["uvs"] = matrix_tensor(model.mesh.uvs);
  arrays["uv_faces"] = matrix_tensor(model.mesh.uv_faces);
  arrays["skin_joints"] = matrix_tensor(model.skin.joints);
  arrays["skin_weights"] = matrix_tensor(model.skin.weights);

  std::vector<std::string> names;
  std::vector<std::string> units;
  RowMatrix ranges(static_cast<Index>(model.shape.size()), 3);
  std::vector<double> joints;
  std::vector<const Blendshape*> surfaces;
  for (std::size_t s = 0; s < model.shape.size(); ++s) {
    const ShapeParameter& parameter = model.shape[s];
    names.push_back(parameter.name);
    units.push_back(parameter.unit);
    ranges.row(static_cast<Index>(s)) << parameter.neutral, parameter.min, parameter.max;
    joints.insert(joints.end(), parameter.joints.data(),
                  parameter.joints.data() + parameter.joints.size());
    surfaces.push_back(&parameter.surface);
  }
  arrays["shape_names"] = text_tensor(names);
  arrays["shape_units"] = text_tensor(units);
  arrays["shape_ranges"] = matrix_tensor(ranges);
  arrays["shape_joints"] =
      tensor_of<double>(joints, {static_cast<std::int64_t>(names.size()), joint_count(model), 3});
  add_surfaces("shape", surfaces, arrays);

  std::vector<int> features;
  RowMatrix axes(static_cast<Index>(model.correctives.size()), 3);
  surfaces.clear();
  for (std::size_t c = 0; c < model.correctives.size(); ++c) {
    const PoseCorrective& corrective = model.correctives[c];
    features.insert(features.end(),
                    {corrective.joint, static_cast<int>(corrective.feature), corrective.component});
    axes.row(static_cast<Index>(c)) = corrective.axis;
    surfaces.push_back(&corrective.surface);
  }
  arrays["corrective_features"] =
      tensor_of<int>(features, {static_cast<std::int64_t>(model.correctives.size()), 3});
  arrays["corrective_axes"] = matrix_tensor(axes);
  add_surfaces("corrective", surfaces, arrays);

  std::vector<std::int64_t> starts = {0};
  std::vector<int> vertices;
  std::vector<double> weights;
  for (const JointRegressor& row : model.regressor) {
    vertices.insert(vertices.end(), row.vertices.begin(), row.vertices.end());
    weights.insert(weights.end(), row.weights.begin(), row.weights.end());
    starts.push_back(static_cast<std::int64_t>(vertices.size()));
  }
  arrays["regressor_starts"] = list_tensor(starts);
  arrays["regressor_vertices"] = list_tensor(vertices);
  arrays["regressor_weights"] = list_tensor(weights);

  names.clear();
  starts = {0};
  vertices.clear();
  for (const VertexGroup& group : model.groups) {
    names.push_back(group.name);
    vertices.insert(vertices.end(), group.vertices.begin(), group.vertices.end());
    starts.push_back(static_cast<std::int64_t>(vertices.size()));
  }
  arrays["group_names"] = text_tensor(names);
  arrays["group_starts"] = list_tensor(starts);
  arrays["group_vertices"] = list_tensor(vertices);
  return arrays;
}

BodyModel body_of_arrays(const Npz& npz, const Limits& limits) {
  expect_schema(npz, kBodySchema);
  const BodyArrayReader reader(npz, limits.mesh_coordinate);
  expect_frame(reader);
  BodyModel model;
  const std::vector<std::string> name = reader.strings("name");
  model.name = name.empty() ? "" : name[0];
  model.skeleton = reader.skeleton();
  check_skeleton(model.skeleton, npz.file());
  model.mesh.vertices = reader.matrix("vertices", 3);
  model.mesh.faces = reader.triangles("faces");
  model.mesh.uvs = reader.matrix("uvs", 2);
  model.mesh.uv_faces = reader.triangles("uv_faces");
  read_skin(reader, model);
  read_shapes(reader, model);
  read_correctives(reader, model);
  read_regressor(reader, model);
  read_groups(reader, model);
  check_body_model(model, npz.file());
  return model;
}

std::map<std::string, Tensor> motion_arrays(const MotionClip& clip) {
  check_motion_clip(clip);
  Arrays arrays;
  arrays["schema"] = text_tensor({kMotionSchema});
  arrays["name"] = text_tensor({clip.name});
  arrays["unit"] = text_tensor({"m"});
  arrays["up"] = text_tensor({"y"});
  add_skeleton(clip.skeleton, arrays);
  std::vector<int> joints;
  RowMatrix offsets(static_cast<Index>(clip.end_sites.size()), 3);
  for (std::size_t e = 0; e < clip.end_sites.size(); ++e) {
    joints.push_back(clip.end_sites[e].joint);
    offsets.row(static_cast<Index>(e)) = clip.end_sites[e].offset;
  }
  arrays["end_site_joints"] = list_tensor(joints);
  arrays["end_site_offsets"] = matrix_tensor(offsets);
  arrays["fps"] = tensor_of<double>(std::vector<double>{clip.motion.fps}, {});
  arrays["frame_ids"] = list_tensor(clip.motion.frame_ids);
  const std::int64_t frames = static_cast<std::int64_t>(clip.motion.poses.size());
  std::vector<double> path;
  std::vector<double> rotations;
  for (const Pose& pose : clip.motion.poses) {
    path.insert(path.end(), pose.root_translation.data(), pose.root_translation.data() + 3);
    rotations.insert(rotations.end(), pose.rotations.data(),
                     pose.rotations.data() + pose.rotations.size());
  }
  arrays["root_translation"] = tensor_of<double>(path, {frames, 3});
  arrays["rotations"] = tensor_of<double>(
      rotations, {frames, static_cast<std::int64_t>(clip.skeleton.names.size()), 3});
  return arrays;
}

MotionClip motion_of_arrays(const Npz& npz, const Limits& limits) {
  expect_schema(npz, kMotionSchema);
  const BodyArrayReader reader(npz, limits.mesh_coordinate);
  expect_frame(reader);
  MotionClip clip;
  const std::vector<std::string> name = reader.strings("name");
  clip.name = name.empty() ? "" : name[0];
  clip.skeleton = reader.skeleton();
  const std::vector<int> joints = reader.integers("end_site_joints");
  const RowMatrix offsets = reader.matrix("end_site_offsets", 3);
  if (offsets.rows() != static_cast<Index>(joints.size())) {
    reader.fail("end_site_offsets", std::to_string(offsets.rows()) + " rows",
                std::to_string(joints.size()) + ", as 'end_site_joints' has");
  }
  for (std::size_t e = 0; e < joints.size(); ++e) {
    clip.end_sites.push_back({joints[e], offsets.row(static_cast<Index>(e)).transpose()});
  }
  const std::vector<double> fps = reader.numbers("fps");
  if (fps.size() != 1) {
    reader.fail("fps", std::to_string(fps.size()) + " numbers", "one");
  }
  clip.motion.fps = fps[0];
  clip.motion.frame_ids = reader.integers("frame_ids");
  const RowMatrix path = reader.matrix("root_translation", 3);
  const std::vector<double> rotations = reader.numbers("rotations");
  const std::size_t block = 3 * clip.skeleton.names.size();
  if (rotations.size() != static_cast<std::size_t>(path.rows()) * block) {
    reader.fail("rotations", std::to_string(rotations.size()) + " numbers",
                std::to_string(path.rows()) + " frames of " + std::to_string(block));
  }
  for (Index frame = 0; frame < path.rows(); ++frame) {
    Pose pose;
    pose.root_translation = path.row(frame);
    pose.rotations =
        Eigen::Map<const Points>(rotations.data() + static_cast<std::size_t>(frame) * block,
                                 static_cast<Index>(block / 3), 3);
    clip.motion.poses.push_back(std::move(pose));
  }
  check_motion_clip(clip, npz.file());
  return clip;
}

void write_body(const std::filesystem::path& path, const BodyModel& model) {
  write_npz(path, body_arrays(model));
}

BodyModel read_body(const std::filesystem::path& path, const Limits& limits) {
  return body_of_arrays(Npz(path, limits), limits);
}

void write_motion(const std::filesystem::path& path, const MotionClip& clip) {
  write_npz(path, motion_arrays(clip));
}

MotionClip read_motion(const std::filesystem::path& path, const Limits& limits) {
  return motion_of_arrays(Npz(path, limits), limits);
}

}  // namespace atelier
