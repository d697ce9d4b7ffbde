#include "bodymodel/formats/personal_body.h"

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/skinning.h"
#include "core/check_bounded.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/tensor.h"

namespace atelier {
namespace {

constexpr const char* kNames = "person_shape_names";
constexpr const char* kShape = "person_shape";
constexpr const char* kDisplacements = "person_displacements";
constexpr const char* kSupport = "person_support";

Tensor bounded(const Npz& npz, const char* name, const Limits& limits) {
  if (!npz.contains(name)) {
    throw DataError(npz.file(), std::string("array '") + name + "'", "missing",
                    "an array of that name");
  }
  Tensor tensor = npz.read(name);
  check_bounded(tensor, limits.mesh_coordinate, npz.file(), name);
  return tensor;
}

Eigen::VectorXd numbers(const Npz& npz, const char* name, const Limits& limits) {
  const std::vector<double> values = doubles_of(bounded(npz, name, limits), npz.file(), name);
  Eigen::VectorXd result(static_cast<Index>(values.size()));
  std::copy(values.begin(), values.end(), result.data());
  return result;
}

}  // namespace

PersonalBody plain_person(const BodyModel& model, const Eigen::VectorXd& shape) {
  check_shape(model, shape);
  PersonalBody person;
  person.shape = shape.size() > 0 ? shape : neutral_shape(model);
  for (const ShapeParameter& parameter : model.shape) {
    person.shape_names.push_back(parameter.name);
  }
  person.model = at_shape(model, person.shape);
  person.model.shape.clear();
  person.model.regressor.clear();
  person.displacements = Points::Zero(vertex_count(model), 3);
  person.support = Eigen::VectorXd::Zero(vertex_count(model));
  return person;
}

void check_personal_body(const PersonalBody& person, const std::string& file) {
  check_body_model(person.model, file);
  const auto fail = [&](const char* where, const std::string& found, const std::string& expected) {
    throw DataError(file, where, found, expected);
  };
  const Index vertices = vertex_count(person.model);
  if (!person.model.shape.empty()) {
    fail("shape_names", std::to_string(person.model.shape.size()) + " shape parameters",
         "none: a person has one shape");
  }
  if (person.shape.size() != static_cast<Index>(person.shape_names.size())) {
    fail(kShape, std::to_string(person.shape.size()) + " values",
         std::to_string(person.shape_names.size()) + ", one for each name");
  }
  if (person.displacements.rows() != vertices) {
    fail(kDisplacements, std::to_string(person.displacements.rows()) + " rows",
         std::to_string(vertices) + ", one for each vertex");
  }
  if (person.support.size() != vertices) {
    fail(kSupport, std::to_string(person.support.size()) + " values",
         std::to_string(vertices) + ", one for each vertex");
  }
  if (!person.shape.allFinite() || !person.displacements.allFinite() ||
      !person.support.allFinite() || (person.support.array() < 0).any()) {
    fail(kSupport, "a number that is not finite, or negative support", "finite numbers");
  }
}

std::map<std::string, Tensor> personal_body_arrays(const PersonalBody& person) {
  check_personal_body(person);
  std::map<std::string, Tensor> arrays = body_arrays(person.model);
  Tensor names{ElementType::Text, {static_cast<std::int64_t>(person.shape_names.size())}, {}, {}};
  names.strings = person.shape_names;
  arrays[kNames] = names;
  arrays[kShape] = tensor_of(person.shape);
  arrays[kDisplacements] = tensor_of(RowMatrix(person.displacements));
  arrays[kSupport] = tensor_of(person.support);
  return arrays;
}

PersonalBody personal_body_of_arrays(const Npz& npz, const Limits& limits) {
  const BodyModel model = body_of_arrays(npz, limits);
  if (!npz.contains(kShape)) {
    return plain_person(model);
  }
  PersonalBody person;
  person.model = model;
  const Tensor names = npz.contains(kNames) ? npz.read(kNames) : Tensor{};
  if (names.type != ElementType::Text && element_count(names) > 0) {
    throw DataError(npz.file(), std::string("array '") + kNames + "'",
                    element_type_name(names.type), "a list of names");
  }
  person.shape_names = names.strings;
  person.shape = numbers(npz, kShape, limits);
  person.displacements =
      matrix_of(bounded(npz, kDisplacements, limits), 3, npz.file(), kDisplacements);
  person.support = numbers(npz, kSupport, limits);
  check_personal_body(person, npz.file());
  return person;
}

void write_personal_body(const std::filesystem::path& path, const PersonalBody& person) {
  write_npz(path, personal_body_arrays(person));
}

PersonalBody read_personal_body(const std::filesystem::path& path, const Limits& limits) {
  return personal_body_of_arrays(Npz(path, limits), limits);
}

}  // namespace atelier
