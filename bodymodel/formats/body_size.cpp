#include "bodymodel/formats/body_size.h"

#include <cmath>
#include <cstdio>
#include <optional>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kAdult = 1.7;  // metres
constexpr double kMinPerson = 0.3;
constexpr double kMaxPerson = 3;
constexpr double kMinBody = 0.02;
constexpr double kMaxBody = 10;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

// The unit that people use which comes nearest to making an adult; where none does, what does.
double likely_unit(double length) {
  double best = kAdult / length;
  double least = std::log(1.6);
  for (const double unit : {0.1, 0.0254, 0.01, 0.001, 10.0, 100.0, 1000.0}) {
    const double off = std::abs(std::log(length * unit / kAdult));
    if (off < least) {
      least = off;
      best = unit;
    }
  }
  return best;
}

// Which way a standing person's head is from the hips; nothing for who does not stand at rest.
std::optional<Eigen::Vector3d> standing_up(const Skeleton& skeleton) {
  const std::optional<Humanoid> person = find_humanoid(skeleton);
  if (!person) {
    return std::nullopt;
  }
  const Points rest = rest_positions(skeleton);
  const Eigen::Vector3d trunk =
      (rest.row(person->neck.back()) - rest.row(person->spine.front())).normalized();
  const Eigen::Vector3d legs = rest.row(person->legs[0].ankle) + rest.row(person->legs[1].ankle) -
                               rest.row(person->legs[0].hip) - rest.row(person->legs[1].hip);
  return trunk.dot(legs.normalized()) < -0.7 ? std::optional(trunk) : std::nullopt;
}

}  // namespace

BodyModel scaled_body(BodyModel model, double factor) {
  ATELIER_CHECK(factor > 0 && std::isfinite(factor), "a body is scaled by a positive factor");
  model.skeleton.offsets *= factor;
  model.mesh.vertices *= factor;
  for (ShapeParameter& parameter : model.shape) {
    if (parameter.unit == "m") {
      parameter.neutral *= factor;
      parameter.min *= factor;
      parameter.max *= factor;
    } else {
      parameter.surface.offsets *= factor;
      parameter.joints *= factor;
    }
  }
  for (PoseCorrective& corrective : model.correctives) {
    corrective.surface.offsets *= factor;
  }
  return model;
}

void check_body_size(const BodyModel& model, const std::string& file) {
  if (model.mesh.vertices.rows() == 0) {
    return;
  }
  const Eigen::RowVector3d size =
      model.mesh.vertices.colwise().maxCoeff() - model.mesh.vertices.colwise().minCoeff();
  const std::optional<Eigen::Vector3d> up = standing_up(model.skeleton);
  if (up && std::abs(up->y()) < 0.7) {
    throw DataError(file, "rest pose",
                    std::string("a person whose head lies along ") +
                        (std::abs(up->z()) > std::abs(up->x()) ? "z" : "x"),
                    "Y up: export the file so (Blender: glTF with +Y Up)");
  }
  const double length = up ? size.y() : size.maxCoeff();
  const double least = up ? kMinPerson : kMinBody;
  const double most = up ? kMaxPerson : kMaxBody;
  if (!(length >= least && length <= most)) {
    throw DataError(
        file, "rest pose",
        (up ? "a person " : "a body ") + number(length) + (up ? " m tall" : " m long"),
        number(least) + " to " + number(most) +
            " m; if its unit is another, set metres_per_unit = " + number(likely_unit(length)));
  }
}

}  // namespace atelier
