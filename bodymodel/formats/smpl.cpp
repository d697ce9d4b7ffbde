#include "bodymodel/formats/smpl.h"

#include <algorithm>
#include <cctype>

#include "bodymodel/formats/body_size.h"
#include "bodymodel/formats/skin_weights.h"
#include "core/check_bounded.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kMinHeight = 0.3;  // metres; babies
constexpr double kMaxHeight = 3;

using Shape = std::vector<std::int64_t>;

// Reads an array and insists on its shape; -1: any. `expected` says the shape in words.
Tensor read(const Npz& npz, const char* name, const Shape& shape, const std::string& expected) {
  if (!npz.contains(name)) {
    throw DataError(npz.file(), std::string("array '") + name + "'", "missing",
                    expected + " (SMPL, SMPL-H, SMPL-X or STAR as npz)");
  }
  Tensor tensor = npz.read(name);
  bool fits = tensor.shape.size() == shape.size();
  for (std::size_t i = 0; fits && i < shape.size(); ++i) {
    fits = shape[i] < 0 || tensor.shape[i] == shape[i];
  }
  if (!fits) {
    throw DataError(npz.file(), std::string("array '") + name + "'",
                    "shape " + shape_text(tensor.shape), expected);
  }
  check_finite(tensor, npz.file(), name);
  return tensor;
}

std::string bracket(const std::string& text, std::int64_t a) {
  return text + " with " + std::to_string(a);
}

Points points_of(const Tensor& tensor, const Npz& npz, const char* name) {
  return matrix_of(tensor, 3, npz.file(), name);
}

Triangles triangles_of(const Tensor& tensor, Index count, const Npz& npz, const char* name) {
  const std::vector<std::int64_t> values = integers_of(tensor, npz.file(), name);
  Triangles faces(static_cast<Index>(values.size() / 3), 3);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] < 0 || values[i] >= count) {
      throw DataError(npz.file(), std::string("array '") + name + "'",
                      "index " + std::to_string(values[i]), "0 to " + std::to_string(count - 1));
    }
    faces.data()[i] = static_cast<int>(values[i]);
  }
  return faces;
}

// Column s of a [V,3,S] array, as offsets.
Points direction(const std::vector<double>& values, Index vertices, std::int64_t columns,
                 std::int64_t column) {
  Points offsets(vertices, 3);
  for (Index i = 0; i < 3 * vertices; ++i) {
    offsets.data()[i] = values[static_cast<std::size_t>(i * columns + column)];
  }
  return offsets;
}

std::vector<int> parents_of(const Npz& npz, Index joints) {
  const Tensor tensor =
      read(npz, "kintree_table", {2, joints}, "shape [2," + std::to_string(joints) + "]");
  const std::vector<std::int64_t> table = integers_of(tensor, npz.file(), "kintree_table");
  std::vector<int> parents;
  for (Index j = 0; j < joints; ++j) {
    const std::int64_t parent = table[static_cast<std::size_t>(j)];
    const std::int64_t self = table[static_cast<std::size_t>(joints + j)];
    if (self != j) {
      throw DataError(npz.file(), "kintree_table",
                      "joint " + std::to_string(self) + " in column " + std::to_string(j),
                      "joints in order");
    }
    // The root's parent is -1, which 32-bit files hold as 4294967295.
    const bool root = parent == -1 || parent == 4'294'967'295;
    if (!root && (parent < 0 || parent >= joints)) {
      throw DataError(npz.file(), "kintree_table", "parent " + std::to_string(parent),
                      "a joint in [0, " + std::to_string(joints) + ")");
    }
    parents.push_back(root ? -1 : static_cast<int>(parent));
  }
  return parents;
}

// Scaled to sums of 1; float32 files are a rounding error away, which is not worth a finding.
PackedSkin skin_of(const Tensor& tensor, const Npz& npz) {
  const RowMatrix dense = matrix_of(tensor, -1, npz.file(), "weights");
  std::vector<std::vector<Influence>> influences(static_cast<std::size_t>(dense.rows()));
  for (Index v = 0; v < dense.rows(); ++v) {
    for (Index j = 0; j < dense.cols(); ++j) {
      if (dense(v, j) != 0) {
        influences[static_cast<std::size_t>(v)].push_back({static_cast<int>(j), dense(v, j)});
      }
    }
  }
  SkinPackOptions pack;
  pack.max_slots = static_cast<int>(dense.cols());
  pack.smallest = 0;
  pack.tolerance = 1e-4;
  return pack_skin_weights(influences, dense.cols(), pack, npz.file());
}

std::vector<JointRegressor> regressor_of(const Tensor& tensor, const Npz& npz) {
  const RowMatrix dense = matrix_of(tensor, -1, npz.file(), "J_regressor");
  std::vector<JointRegressor> rows(static_cast<std::size_t>(dense.rows()));
  for (Index j = 0; j < dense.rows(); ++j) {
    for (Index v = 0; v < dense.cols(); ++v) {
      if (dense(j, v) != 0) {
        rows[static_cast<std::size_t>(j)].vertices.push_back(static_cast<int>(v));
        rows[static_cast<std::size_t>(j)].weights.push_back(dense(j, v));
      }
    }
  }
  return rows;
}

Points regressed(const std::vector<JointRegressor>& regressor, const Points& vertices) {
  Points joints = Points::Zero(static_cast<Index>(regressor.size()), 3);
  for (std::size_t j = 0; j < regressor.size(); ++j) {
    for (std::size_t i = 0; i < regressor[j].vertices.size(); ++i) {
      joints.row(static_cast<Index>(j)) +=
          regressor[j].weights[i] * vertices.row(regressor[j].vertices[i]);
    }
  }
  return joints;
}

void check_height(const Points& vertices, double metres_per_unit, const std::string& file) {
  const double height = metres_per_unit * (vertices.col(1).maxCoeff() - vertices.col(1).minCoeff());
  if (!(height > kMinHeight && height < kMaxHeight)) {
    throw DataError(file, "array 'v_template'", "a body " + short_number(height) + " tall",
                    "metres, Y up: 0.3 to 3 (set metres_per_unit, 0.01 for centimetres, or turn "
                    "the file's vertices)");
  }
}

void add_shape(const Npz& npz, const SmplOptions& options, const Limits& limits, BodyModel& model) {
  const Index vertices = vertex_count(model);
  const Tensor tensor =
      read(npz, "shapedirs", {vertices, 3, -1}, bracket("shape [V,3,S]", vertices) + " vertices");
  const std::int64_t columns = tensor.shape[2];
  check_bounded(tensor, limits.mesh_coordinate, npz.file(), "shapedirs");
  const std::vector<double> values = doubles_of(tensor, npz.file(), "shapedirs");
  const bool face = joint_count(model) == 55;
  // SMPL-X: 300 shape then 100 expression directions, or 10 then 10 in its first version.
  const std::int64_t first_expression = !face ? columns : (columns >= 400 ? 300 : columns / 2);
  const auto add = [&](const std::string& name, std::int64_t column) {
    ShapeParameter parameter;
    parameter.name = name;
    parameter.unit = "sd";
    parameter.min = -5;
    parameter.max = 5;
    parameter.surface.offsets = direction(values, vertices, columns, column);
    parameter.joints = regressed(model.regressor, parameter.surface.offsets);
    model.shape.push_back(std::move(parameter));
  };
  for (std::int64_t s = 0; s < std::min<std::int64_t>(options.betas, first_expression); ++s) {
    add("beta_" + std::to_string(s), s);
  }
  for (std::int64_t e = 0;
       e < std::min<std::int64_t>(options.expressions, columns - first_expression); ++e) {
    add("expression_" + std::to_string(e), first_expression + e);
  }
}

void add_correctives(const Npz& npz, const Limits& limits, BodyModel& model) {
  const Index vertices = vertex_count(model);
  const Index joints = joint_count(model);
  const std::int64_t rotations = 9 * (joints - 1);
  const std::int64_t quaternions = 4 * (joints - 1) + 1;
  const std::string expected = "shape [V,3,P] with " + std::to_string(vertices) +
                               " vertices and P = " + std::to_string(rotations) +
                               " rotation entries (SMPL) or " + std::to_string(quaternions) +
                               " (STAR)";
  Tensor tensor = npz.contains("posedirs") ? npz.read("posedirs") : Tensor{};
  const bool flat = tensor.shape.size() == 2;  // [P,3V], as some converters write it
  if (flat) {
    tensor = read(npz, "posedirs", {-1, 3 * vertices}, expected);
  } else {
    tensor = read(npz, "posedirs", {vertices, 3, -1}, expected);
  }
  const std::int64_t columns = flat ? tensor.shape[0] : tensor.shape[2];
  if (columns != rotations && columns != quaternions) {
    throw DataError(npz.file(), "array 'posedirs'", "shape " + shape_text(tensor.shape), expected);
  }
  check_bounded(tensor, limits.mesh_coordinate, npz.file(), "posedirs");
  const std::vector<double> values = doubles_of(tensor, npz.file(), "posedirs");
  const auto offsets = [&](std::int64_t column) {
    if (!flat) {
      return direction(values, vertices, columns, column);
    }
    const std::size_t start = static_cast<std::size_t>(column * 3 * vertices);
    return Points(Eigen::Map<const Points>(values.data() + start, vertices, 3));
  };
  const bool star = columns == quaternions;
  const int entries = star ? 4 : 9;
  for (Index j = 1; j < joints; ++j) {
    for (int c = 0; c < entries; ++c) {
      PoseCorrective corrective;
      corrective.joint = static_cast<int>(j);
      corrective.feature = star ? PoseFeature::QuaternionEntry : PoseFeature::RotationEntry;
      corrective.component = c;
      corrective.surface.offsets = offsets((j - 1) * entries + c);
      model.correctives.push_back(std::move(corrective));
    }
  }
  if (star) {
    // STAR's last feature is the second shape value: a shape direction that moves no joint.
    const int beta = find_shape(model, "beta_1");
    if (beta >= 0) {
      model.shape[static_cast<std::size_t>(beta)].surface.offsets += offsets(columns - 1);
    }
  }
}

// "female", "male" or "neutral" where a file or its folder is named so: SMPLX_FEMALE.npz,
// male/model.npz, basicmodel_f_lbs_10_207_0_v1.1.0.npz; else "". The arrays do not say it.
std::string gender_of_name(const std::filesystem::path& file) {
  const auto gender_in = [](const std::string& name) -> std::string {
    bool basic = false;
    std::string word;
    for (const char c : name + "_") {
      if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
        word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        continue;
      }
      if (word == "female" || word == "male" || word == "neutral") {
        return word;
      }
      if (basic && (word == "f" || word == "m")) {
        return word == "f" ? "female" : "male";
      }
      basic = basic || word == "basicmodel";
      word.clear();
    }
    return "";
  };
  const std::string own = gender_in(file.stem().string());
  return own.empty() ? gender_in(file.parent_path().filename().string()) : own;
}

}  // namespace

SmplBody read_smpl(const Npz& npz, const SmplOptions& options, const Limits& limits) {
  ATELIER_CHECK(options.betas >= 0 && options.expressions >= 0, "numbers of directions");
  ATELIER_CHECK(options.metres_per_unit > 0, "metres per unit are positive");
  SmplBody body;
  BodyModel& model = body.model;
  const Tensor rest = read(npz, "v_template", {-1, 3}, "shape [V,3]");
  check_bounded(rest, limits.mesh_coordinate, npz.file(), "v_template");
  model.mesh.vertices = points_of(rest, npz, "v_template");
  const Index vertices = vertex_count(model);
  if (vertices < 4) {
    throw DataError(npz.file(), "array 'v_template'", "shape " + shape_text(rest.shape),
                    "a body's vertices");
  }
  check_height(model.mesh.vertices, options.metres_per_unit, npz.file());
  model.mesh.faces = triangles_of(read(npz, "f", {-1, 3}, "shape [F,3]"), vertices, npz, "f");
  if (npz.contains("vt") && npz.contains("ft")) {
    const Tensor uvs = read(npz, "vt", {-1, 2}, "shape [T,2]");
    const Tensor uv_faces = read(npz, "ft", {model.mesh.faces.rows(), 3},
                                 bracket("shape [F,3]", model.mesh.faces.rows()) + " faces");
    check_bounded(uvs, limits.mesh_coordinate, npz.file(), "vt");
    model.mesh.uvs = matrix_of(uvs, 2, npz.file(), "vt");
    model.mesh.uv_faces = triangles_of(uv_faces, model.mesh.uvs.rows(), npz, "ft");
  }
  const Tensor weights =
      read(npz, "weights", {vertices, -1}, bracket("shape [V,J]", vertices) + " vertices");
  const Index joints = weights.shape[1];
  if (joints != 24 && joints != 52 && joints != 55) {
    throw DataError(npz.file(), "array 'weights'", "shape " + shape_text(weights.shape),
                    "24 joints (SMPL, STAR), 52 (SMPL-H) or 55 (SMPL-X)");
  }
  PackedSkin packed = skin_of(weights, npz);
  model.skin = std::move(packed.skin);
  body.findings = std::move(packed.findings);
  model.regressor = regressor_of(read(npz, "J_regressor", {joints, vertices},
                                      "shape [J,V] with " + std::to_string(joints) +
                                          " joints and " + std::to_string(vertices) + " vertices"),
                                 npz);
  model.skeleton.names = smpl_joint_names(joints);
  model.skeleton.parents = parents_of(npz, joints);
  const Points places = regressed(model.regressor, model.mesh.vertices);
  model.skeleton.offsets = places;
  for (Index j = 0; j < joints; ++j) {
    const int parent = model.skeleton.parents[static_cast<std::size_t>(j)];
    if (parent >= 0) {
      model.skeleton.offsets.row(j) -= places.row(parent);
    }
  }
  add_shape(npz, options, limits, model);
  add_correctives(npz, limits, model);
  const bool star =
      !model.correctives.empty() && model.correctives[0].feature == PoseFeature::QuaternionEntry;
  model.name = star ? "star" : joints == 24 ? "smpl" : joints == 52 ? "smplh" : "smplx";
  if (const std::string gender = gender_of_name(npz.file()); !gender.empty()) {
    model.name += "_" + gender;
  }
  check_body_model(model, npz.file());
  if (options.metres_per_unit != 1) {
    model = scaled_body(std::move(model), options.metres_per_unit);
  }
  return body;
}

SmplBody read_smpl(const std::filesystem::path& path, const SmplOptions& options,
                   const Limits& limits) {
  return read_smpl(Npz(path, limits), options, limits);
}

}  // namespace atelier
