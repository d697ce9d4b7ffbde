#include "bodymodel/body_model.h"

#include <cmath>
#include <set>

#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr double kWeightSumTolerance = 1e-6;
constexpr double kUnitTolerance = 1e-6;

void check_blendshape(const Blendshape& shape, Index vertices, const std::string& file,
                      const std::string& where) {
  const Index rows = shape.vertices.empty() ? vertices : static_cast<Index>(shape.vertices.size());
  if (shape.offsets.rows() != rows) {
    throw DataError(file, where, std::to_string(shape.offsets.rows()) + " offsets",
                    std::to_string(rows) + ", one for each vertex");
  }
  int previous = -1;
  for (const int vertex : shape.vertices) {
    if (vertex <= previous || vertex >= vertices) {
      throw DataError(file, where, "vertex " + std::to_string(vertex),
                      "increasing indices below " + std::to_string(vertices));
    }
    previous = vertex;
  }
  if (!shape.offsets.allFinite()) {
    throw DataError(file, where, "an offset that is not finite", "finite metres");
  }
}

void check_skin(const SkinWeights& skin, Index vertices, Index joints, const std::string& file) {
  if (skin.weights.rows() != vertices || skin.joints.rows() != vertices) {
    throw DataError(file, "skin weights",
                    std::to_string(skin.joints.rows()) + " rows of joints and " +
                        std::to_string(skin.weights.rows()) + " of weights",
                    std::to_string(vertices) + " rows, one for each vertex");
  }
  if (skin.weights.cols() != skin.joints.cols() || skin.weights.cols() < 1) {
    throw DataError(file, "skin weights",
                    std::to_string(skin.joints.cols()) + " joints and " +
                        std::to_string(skin.weights.cols()) + " weights for each vertex",
                    "as many of both, at least one");
  }
  for (Index v = 0; v < vertices; ++v) {
    double sum = 0;
    for (Index k = 0; k < skin.weights.cols(); ++k) {
      const double weight = skin.weights(v, k);
      const int joint = skin.joints(v, k);
      if (joint < 0 || joint >= joints) {
        throw DataError(file, "skin weights of vertex " + std::to_string(v),
                        "joint " + std::to_string(joint),
                        "a joint in [0, " + std::to_string(joints) + ")");
      }
      if (!(weight >= 0) || !std::isfinite(weight)) {
        throw DataError(file, "skin weights of vertex " + std::to_string(v),
                        "weight " + short_number(weight, 7),
                        "a finite weight that is not negative");
      }
      sum += weight;
    }
    if (!(std::abs(sum - 1) <= kWeightSumTolerance)) {
      throw DataError(file, "skin weights of vertex " + std::to_string(v),
                      "weights that sum to " + short_number(sum, 7), "a sum of 1");
    }
  }
}

void check_parameters(const BodyModel& model, const std::string& file) {
  std::set<std::string> names;
  for (const ShapeParameter& parameter : model.shape) {
    const std::string where = "shape parameter " + parameter.name;
    if (parameter.name.empty() || !names.insert(parameter.name).second) {
      throw DataError(file, where, "an empty or repeated name", "a name of its own");
    }
    if (!(parameter.min <= parameter.neutral && parameter.neutral <= parameter.max) ||
        !std::isfinite(parameter.min) || !std::isfinite(parameter.max)) {
      throw DataError(file, where,
                      "neutral " + short_number(parameter.neutral, 7) + " in range " +
                          short_number(parameter.min, 7) + " to " + short_number(parameter.max, 7),
                      "a finite range that holds the neutral value");
    }
    check_blendshape(parameter.surface, vertex_count(model), file, where);
    if (parameter.joints.rows() != joint_count(model) || !parameter.joints.allFinite()) {
      throw DataError(file, where, std::to_string(parameter.joints.rows()) + " joint offsets",
                      std::to_string(joint_count(model)) + " finite ones, one for each joint");
    }
  }
}

void check_correctives(const BodyModel& model, const std::string& file) {
  for (std::size_t c = 0; c < model.correctives.size(); ++c) {
    const PoseCorrective& corrective = model.correctives[c];
    const std::string where = "pose corrective " + std::to_string(c);
    if (corrective.joint < 0 || corrective.joint >= joint_count(model)) {
      throw DataError(file, where, "joint " + std::to_string(corrective.joint),
                      "a joint in [0, " + std::to_string(joint_count(model)) + ")");
    }
    const int components = corrective.feature == PoseFeature::RotationEntry     ? 9
                           : corrective.feature == PoseFeature::QuaternionEntry ? 4
                                                                                : 1;
    if (corrective.component < 0 || corrective.component >= components) {
      throw DataError(file, where, "component " + std::to_string(corrective.component),
                      "a component below " + std::to_string(components));
    }
    if (corrective.feature == PoseFeature::Bend &&
        !(std::abs(corrective.axis.norm() - 1) <= kUnitTolerance)) {
      throw DataError(file, where, "an axis of length " + short_number(corrective.axis.norm(), 7),
                      "unit length");
    }
    check_blendshape(corrective.surface, vertex_count(model), file, where);
  }
}

void check_regressor(const BodyModel& model, const std::string& file) {
  if (model.regressor.empty()) {
    return;
  }
  if (static_cast<Index>(model.regressor.size()) != joint_count(model)) {
    throw DataError(file, "joint regressor", std::to_string(model.regressor.size()) + " rows",
                    std::to_string(joint_count(model)) + ", one for each joint");
  }
  for (std::size_t j = 0; j < model.regressor.size(); ++j) {
    const JointRegressor& row = model.regressor[j];
    const std::string where = "joint regressor row " + std::to_string(j);
    if (row.vertices.size() != row.weights.size()) {
      throw DataError(file, where,
                      std::to_string(row.vertices.size()) + " vertices and " +
                          std::to_string(row.weights.size()) + " weights",
                      "as many of both");
    }
    int previous = -1;
    for (std::size_t i = 0; i < row.vertices.size(); ++i) {
      if (row.vertices[i] <= previous || row.vertices[i] >= vertex_count(model) ||
          !std::isfinite(row.weights[i])) {
        throw DataError(file, where, "vertex " + std::to_string(row.vertices[i]),
                        "increasing vertices below " + std::to_string(vertex_count(model)) +
                            " with finite weights");
      }
      previous = row.vertices[i];
    }
  }
}

void check_groups(const BodyModel& model, const std::string& file) {
  std::set<std::string> names;
  for (const VertexGroup& group : model.groups) {
    const std::string where = "vertex group " + group.name;
    if (group.name.empty() || !names.insert(group.name).second) {
      throw DataError(file, where, "an empty or repeated name", "a name of its own");
    }
    for (const int vertex : group.vertices) {
      if (vertex < 0 || vertex >= vertex_count(model)) {
        throw DataError(file, where, "vertex " + std::to_string(vertex),
                        "a vertex in [0, " + std::to_string(vertex_count(model)) + ")");
      }
    }
  }
}

}  // namespace

Index joint_count(const BodyModel& model) {
  return static_cast<Index>(model.skeleton.names.size());
}

Index vertex_count(const BodyModel& model) {
  return model.mesh.vertices.rows();
}

Eigen::VectorXd neutral_shape(const BodyModel& model) {
  Eigen::VectorXd shape(static_cast<Index>(model.shape.size()));
  for (Index s = 0; s < shape.size(); ++s) {
    shape[s] = model.shape[static_cast<std::size_t>(s)].neutral;
  }
  return shape;
}

int find_shape(const BodyModel& model, const std::string& name) {
  for (std::size_t s = 0; s < model.shape.size(); ++s) {
    if (model.shape[s].name == name) {
      return static_cast<int>(s);
    }
  }
  return -1;
}

void check_body_model(const BodyModel& model, const std::string& file) {
  check_skeleton(model.skeleton, file);
  check_mesh(model.mesh, file);
  check_skin(model.skin, vertex_count(model), joint_count(model), file);
  check_parameters(model, file);
  check_correctives(model, file);
  check_regressor(model, file);
  check_groups(model, file);
}

void check_shape(const BodyModel& model, const Eigen::VectorXd& shape) {
  ATELIER_CHECK(shape.size() == 0 || shape.size() == static_cast<Index>(model.shape.size()),
                "shape has " + std::to_string(shape.size()) + " values, the model " + model.name +
                    " has " + std::to_string(model.shape.size()) + " parameters");
  ATELIER_CHECK(shape.allFinite(), "shape has a value that is not finite");
}

}  // namespace atelier
