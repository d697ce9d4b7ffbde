#include "pipeline/synthesis/synthetic_subject.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "capture/fabric.h"
#include "core/error.h"
#include "core/normals.h"

namespace atelier {
namespace {

// Streams of random numbers, one per purpose, so that a change in one leaves the others alone.
constexpr std::uint64_t kShape = 1;
constexpr std::uint64_t kDisplacement = 2;
constexpr std::uint64_t kWeights = 3;

Eigen::VectorXd drawn_shape(const BodyModel& model, Random& random) {
  Eigen::VectorXd shape = neutral_shape(model);
  for (Index s = 0; s < shape.size(); ++s) {
    const ShapeParameter& parameter = model.shape[static_cast<std::size_t>(s)];
    if (parameter.unit == "sd") {
      shape[s] = std::clamp(normal(random), -2.0, 2.0);
    }
  }
  return shape;
}

struct Drawn {
  BodyModel model;
  std::vector<std::string> names;
  Eigen::VectorXd shape;
};

Drawn drawn_body(const SubjectOptions& options, Random random) {
  if (options.body == "random" || options.body == "female" || options.body == "male") {
    const double sex = uniform(random) < 0.5 ? 0 : 1;
    DefaultHumanOptions human = options.body == "female" ? female_human()
                                : options.body == "male" ? male_human()
                                                         : random_human(random, sex, 0.15, 0.85);
    human.shape_basis = false;
    Drawn drawn{default_human(human), {}, {}};
    OptionTable table = describe(human);
    std::vector<double> values;
    for (const OptionField& field : table.fields) {
      if (const auto* const* number = std::get_if<double*>(&field.target)) {
        drawn.names.push_back(field.name);
        values.push_back(**number);
      }
    }
    drawn.shape = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
    return drawn;
  }
  Drawn drawn{read_body_file(options.body).model, {}, {}};
  drawn.shape = drawn_shape(drawn.model, random);
  for (const ShapeParameter& parameter : drawn.model.shape) {
    drawn.names.push_back(parameter.name);
  }
  return drawn;
}

/// The model at a shape, with no shape left to choose.
BodyModel person_of(const BodyModel& model, const Eigen::VectorXd& shape) {
  const ShapedBody shaped = shape_body(model, shape);
  BodyModel person = model;
  person.skeleton = shaped.skeleton;
  person.mesh.vertices = shaped.vertices;
  person.shape.clear();
  person.regressor.clear();
  return person;
}

/// Share of each vertex that joints of a set move.
Eigen::VectorXd moved_by(const BodyModel& model, const std::vector<double>& joint_values) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(vertex_count(model));
  for (Index v = 0; v < result.size(); ++v) {
    for (Index k = 0; k < model.skin.joints.cols(); ++k) {
      result[v] += model.skin.weights(v, k) *
                   joint_values[static_cast<std::size_t>(model.skin.joints(v, k))];
    }
  }
  return result;
}

/// Per joint: 1 on trunk, thighs and upper arms, less on shins and forearms, 0 on head, hands,
/// feet.
std::vector<double> joint_values(const Skeleton& skeleton, double trunk, double upper, double lower,
                                 double ends) {
  const Humanoid person = recognised_humanoid(skeleton);
  std::vector<double> values(skeleton.names.size(), trunk);
  const auto set = [&](int joint, double value) {
    if (joint >= 0) {
      values[static_cast<std::size_t>(joint)] = value;
    }
  };
  for (const Leg& leg : person.legs) {
    set(leg.hip, upper);
    set(leg.knee, lower);
    set(leg.ankle, ends);
  }
  for (const Arm& arm : person.arms) {
    set(arm.shoulder, upper);
    set(arm.elbow, lower);
    set(arm.wrist, ends);
  }
  set(person.neck.front(), lower);
  set(person.neck.back(), ends);
  // Fingers, toes, jaw and eyes are as what they hang on.
  std::vector<bool> end(values.size(), false);
  for (std::size_t j = 0; j < values.size(); ++j) {
    const int parent = skeleton.parents[j];
    const auto is = [&](int joint) { return static_cast<int>(j) == joint; };
    end[j] = is(person.legs[0].ankle) || is(person.legs[1].ankle) || is(person.arms[0].wrist) ||
             is(person.arms[1].wrist) || is(person.neck.back()) ||
             (parent >= 0 && end[static_cast<std::size_t>(parent)]);
    if (end[j]) {
      values[j] = ends;
    }
  }
  return values;
}

/// m. A surface that cuts a plane wave aslant sees a longer one: these make 5 to 20 cm on the skin.
constexpr double kLongestWave = 0.17;

/// A sum of plane waves along the normals, whose rms over the area is `rms`.
void displace(BodyModel& model, double rms, Random random) {
  struct Wave {
    Eigen::Vector3d k;
    double phase, amplitude;
  };
  std::vector<Wave> waves;
  for (int i = 0; i < 32; ++i) {
    const double length = uniform(random, 0.05, kLongestWave);
    Eigen::Vector3d direction;
    do {
      for (double& c : direction) {
        c = normal(random);
      }
    } while (direction.norm() < 1e-6);
    waves.push_back({2 * std::numbers::pi / length * direction.normalized(),
                     uniform(random, 0, 2 * std::numbers::pi), length * length});
  }
  const Eigen::VectorXd share = moved_by(model, joint_values(model.skeleton, 1, 1, 0.7, 0.12));
  const Points normals = vertex_normals(model.mesh.vertices, model.mesh.faces);
  const Eigen::VectorXd areas = vertex_areas(model.mesh.vertices, model.mesh.faces);
  Eigen::VectorXd height(share.size());
  for (Index v = 0; v < height.size(); ++v) {
    double sum = 0;
    for (const Wave& wave : waves) {
      sum += wave.amplitude *
             std::cos(wave.k.dot(model.mesh.vertices.row(v).transpose()) + wave.phase);
    }
    height[v] = share[v] * sum;
  }
  // A wave of 25 mm against its own slope folds thin limbs: the largest are rounded off, and the
  // whole is drawn larger until its rms is what was asked.
  const double most = 2.5 * rms;
  const auto rounded = [&](double factor) -> Eigen::VectorXd {
    return most * (factor / most * height.array()).tanh();
  };
  const auto rms_of = [&](const Eigen::VectorXd& values) {
    return std::sqrt(values.cwiseAbs2().dot(areas) / areas.sum());
  };
  double factor = rms / rms_of(height);
  for (int i = 0; i < 20; ++i) {
    factor *= rms / rms_of(rounded(factor));
  }
  height = rounded(factor);
  model.mesh.vertices += (normals.array().colwise() * height.array()).matrix();
}

double displaced_rms(const BodyModel& model, const Points& before) {
  const Eigen::VectorXd areas = vertex_areas(before, model.mesh.faces);
  return std::sqrt((model.mesh.vertices - before).rowwise().squaredNorm().dot(areas) / areas.sum());
}

void jitter_weights(BodyModel& model, double share, std::uint64_t seed) {
  for (Index v = 0; v < vertex_count(model); ++v) {
    const Eigen::Vector3d p = model.mesh.vertices.row(v).transpose() / 0.08;
    double sum = 0;
    for (Index k = 0; k < model.skin.weights.cols(); ++k) {
      const auto joint = static_cast<std::uint64_t>(model.skin.joints(v, k));
      const double noise = value_noise(p.x(), p.y(), p.z(), seed + 131 * joint);
      model.skin.weights(v, k) *= std::max(0.0, 1 + 2 * share * noise);
      sum += model.skin.weights(v, k);
    }
    model.skin.weights.row(v) /= sum;
  }
}

}  // namespace

OptionTable describe(SubjectOptions& options) {
  OptionTable table;
  table
      .add("body", options.body, std::vector<std::string>{},
           "Body of the subject: random, female, male, or a body model file")
      .add("subject", options.subject, std::vector<std::string>{"real", "exact"},
           "Body shape: real leaves the shape space of the model; exact stays within it, for "
           "debugging a stage only")
      .add("displacement", options.displacement, 0, 0.03, "m",
           "RMS displacement off the shape space; 0: random from 5 to 10 mm")
      .add("weight_jitter", options.weight_jitter, 0, 0.5, "",
           "Strength of the random deviation of skinning weights from the model's")
      .add("soft_tissue", options.soft_tissue, 0, 0.02, "m",
           "Amplitude by which soft tissue lags behind");
  return table;
}

SyntheticSubject make_subject(const SubjectOptions& options, std::uint64_t seed) {
  Drawn drawn = drawn_body(options, {seed, kShape});
  SyntheticSubject subject;
  subject.shape_names = std::move(drawn.names);
  subject.shape = drawn.shape;
  subject.model =
      person_of(drawn.model, drawn.model.shape.empty() ? Eigen::VectorXd() : drawn.shape);
  recognised_humanoid(subject.model.skeleton, options.body);
  const Points before = subject.model.mesh.vertices;
  if (options.subject == "real") {
    Random random{seed, kDisplacement};
    const double drawn_rms = uniform(random, 0.005, 0.010);
    displace(subject.model, options.displacement > 0 ? options.displacement : drawn_rms, random);
    jitter_weights(subject.model, options.weight_jitter, seed * 31 + kWeights);
    subject.softness = moved_by(subject.model, joint_values(subject.model.skeleton, 1, 1, 0.6, 0));
  } else {
    subject.softness = Eigen::VectorXd::Zero(before.rows());
  }
  subject.displacement_rms = displaced_rms(subject.model, before);
  char line[160];
  const double height =
      subject.model.mesh.vertices.col(1).maxCoeff() - subject.model.mesh.vertices.col(1).minCoeff();
  std::snprintf(line, sizeof(line), "%s, %.2f m tall, %.1f mm rms off the shape space",
                subject.model.name.c_str(), height, 1000 * subject.displacement_rms);
  subject.description = line;
  return subject;
}

Points posed_points(const BodyModel& model, const std::vector<JointPoint>& points,
                    const Pose& pose) {
  const JointFrames rest = forward_kinematics(model.skeleton, rest_pose(model.skeleton));
  const JointFrames now = forward_kinematics(model.skeleton, pose);
  Points result(static_cast<Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto j = static_cast<std::size_t>(points[i].joint);
    const Eigen::Vector3d at_rest = rest.positions.row(points[i].joint).transpose();
    const Eigen::Vector3d local = rest.rotations[j].transpose() * (points[i].rest - at_rest);
    result.row(static_cast<Index>(i)) =
        (now.rotations[j] * local).transpose() + now.positions.row(points[i].joint);
  }
  return result;
}

SoftTissue soft_tissue_step(SoftTissue state, const Points& skinned, double seconds) {
  const double omega = 2 * std::numbers::pi * 4.5;
  const double damping = 2 * 0.25 * omega;
  if (state.steps == 0) {
    state.offset = state.velocity = state.last_velocity = Points::Zero(skinned.rows(), 3);
  } else {
    const Points velocity = (skinned - state.last) / seconds;
    const Points acceleration = state.steps == 1
                                    ? Points(Points::Zero(skinned.rows(), 3))
                                    : Points((velocity - state.last_velocity) / seconds);
    // Implicit Euler: stable at any rate.
    const double denominator = 1 + seconds * damping + seconds * seconds * omega * omega;
    state.velocity =
        (state.velocity - seconds * (acceleration + omega * omega * state.offset)) / denominator;
    state.offset += seconds * state.velocity;
    state.last_velocity = velocity;
  }
  state.last = skinned;
  ++state.steps;
  return state;
}

Points with_soft_tissue(const SyntheticSubject& subject, const Points& skinned,
                        const SoftTissue& state, double amplitude) {
  if (amplitude <= 0 || state.offset.rows() != skinned.rows()) {
    return skinned;
  }
  const double most = 2 * amplitude;
  Points result = skinned;
  for (Index v = 0; v < result.rows(); ++v) {
    const double length = state.offset.row(v).norm();
    result.row(v) += subject.softness[v] * most / (most + length) * state.offset.row(v);
  }
  return result;
}

}  // namespace atelier
