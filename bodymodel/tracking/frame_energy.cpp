#include "bodymodel/tracking/frame_energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr double kTrunkFreedom = 0.4;  // of the limbs' freedom: the spine bends evenly
constexpr double kEndFreedom = 0.35;   // feet, hands, collars: little tells of them
constexpr double kFingerFreedom = 0.3;

/// Geman and McClure's function of a squared residual s, and its derivative: s near 0, at most c2.
struct Robust {
  double value;
  double weight;
};
Robust geman_mcclure(double s, double c2) {
  const double share = c2 / (c2 + s);
  return {share * s, share * share};
}

void seek(FittedPerson& person, int joint, double freedom, std::vector<double>& stiffness) {
  if (joint >= 0) {
    stiffness[static_cast<std::size_t>(joint)] = 1 / (freedom * freedom);
    person.slots[static_cast<std::size_t>(joint)] = 0;
  }
}

/// Sums of weighted outer products of rows that have few entries.
class Normal {
 public:
  Normal(Index size, bool on) : on_(on) {
    if (on) {
      gradient = Eigen::VectorXd::Zero(size);
      hessian = Eigen::MatrixXd::Zero(size, size);
      row_ = Eigen::VectorXd::Zero(size);
      touched_.reserve(static_cast<std::size_t>(size));
      is_touched_.assign(static_cast<std::size_t>(size), 0);
    }
  }
  bool on() const { return on_; }

  void add(Index column, double value) {
    const auto c = static_cast<std::size_t>(column);
    if (is_touched_[c] == 0) {
      is_touched_[c] = 1;
      touched_.push_back(column);
    }
    row_[column] += value;
  }
  /// Ends a row: its residual and weight.
  void close(double residual, double weight) {
    for (std::size_t a = 0; a < touched_.size(); ++a) {
      const Index i = touched_[a];
      const double scaled = weight * row_[i];
      gradient[i] += scaled * residual;
      for (std::size_t b = 0; b <= a; ++b) {
        const Index j = touched_[b];
        hessian(std::max(i, j), std::min(i, j)) += scaled * row_[j];
      }
    }
    for (const Index i : touched_) {
      row_[i] = 0;
      is_touched_[static_cast<std::size_t>(i)] = 0;
    }
    touched_.clear();
  }
  /// Mirrors the lower half.
  void finish() { hessian.triangularView<Eigen::StrictlyUpper>() = hessian.transpose(); }

  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;

 private:
  bool on_;
  Eigen::VectorXd row_;
  std::vector<Index> touched_;
  std::vector<char> is_touched_;
};

void add_keypoints(const FittedPerson& person, const FrameTargets& targets,
                   const FrameWeights& weights, const JointFrames& frames,
                   const std::vector<Eigen::Matrix3d>& bases, Index shape_column, double& cost,
                   Normal& normal) {
  const Skeleton& skeleton = person.shaped.skeleton;
  const Eigen::MatrixXd by_shape =
      shape_column >= 0 ? joint_positions_shape_jacobian(*person.model, frames) : Eigen::MatrixXd{};
  for (Index k = 0; k < targets.keypoints.rows(); ++k) {
    const int carrier = person.places.riding.joints[static_cast<std::size_t>(k)];
    if (carrier < 0 || !(targets.deviations[k] > 0)) {
      continue;
    }
    const Eigen::Vector3d offset = person.places.riding.offsets.row(k);
    const Eigen::Vector3d at = frames.positions.row(carrier).transpose() +
                               frames.rotations[static_cast<std::size_t>(carrier)] * offset;
    const Eigen::Vector3d gap = at - targets.keypoints.row(k).transpose();
    const double spread = person.places.spread[k];
    const double variance = weights.keypoint * weights.keypoint +
                            targets.deviations[k] * targets.deviations[k] + spread * spread;
    const double c2 = weights.keypoint_outlier * weights.keypoint_outlier / variance;
    const Robust robust = geman_mcclure(gap.squaredNorm() / variance, c2);
    cost += 0.5 * robust.value;
    if (!normal.on()) {
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      normal.add(c, 1);
      for (int joint = carrier; joint >= 0;
           joint = skeleton.parents[static_cast<std::size_t>(joint)]) {
        const int slot = person.slots[static_cast<std::size_t>(joint)];
        if (slot < 0) {
          continue;
        }
        const Eigen::Vector3d arm = at - frames.positions.row(joint).transpose();
        // Row c of -[arm]x W: the derivative of e_c . (w x arm) by w is arm x e_c.
        const Eigen::Vector3d turn = arm.cross(Eigen::Vector3d::Unit(c));
        const Eigen::Vector3d row = bases[static_cast<std::size_t>(joint)].transpose() * turn;
        for (int i = 0; i < 3; ++i) {
          normal.add(3 + 3 * slot + i, row[i]);
        }
      }
      for (Index s = 0; s < by_shape.cols(); ++s) {
        const Eigen::Vector3d place =
            person.places_by_shape[static_cast<std::size_t>(s)].row(k).transpose();
        normal.add(shape_column + s,
                   by_shape(3 * carrier + c, s) +
                       frames.rotations[static_cast<std::size_t>(carrier)].row(c).dot(place));
      }
      normal.close(gap[c], robust.weight / variance);
    }
  }
}

/// Rows of matches by shape, [M,S].
Eigen::MatrixXd match_shape_rows(const FittedPerson& person, const PosedBody& posed,
                                 const std::vector<SurfaceMatch>& matches) {
  const auto count = static_cast<Index>(matches.size());
  std::vector<int> vertices;
  vertices.reserve(3 * matches.size());
  Points scaled(3 * count, 3);
  for (const SurfaceMatch& match : matches) {
    for (Index c = 0; c < 3; ++c) {
      scaled.row(static_cast<Index>(vertices.size())) =
          match.barycentric[c] * match.normal.transpose();
      vertices.push_back(match.vertices[static_cast<std::size_t>(c)]);
    }
  }
  const Eigen::MatrixXd corners =
      skin_shape_rows(*person.model, person.shaped, posed, vertices, scaled);
  Eigen::MatrixXd rows(count, corners.cols());
  for (Index m = 0; m < count; ++m) {
    rows.row(m) = corners.middleRows<3>(3 * m).colwise().sum();
  }
  return rows;
}

/// A match at a pose: how far the body is out, m, and its share of the normal equations, 1/m2.
struct MatchState {
  double out;
  double weight;
  double cost;
};
MatchState match_state(const SurfaceMatch& match, const Eigen::Vector3d& at,
                       const FrameWeights& weights) {
  const double out = match.normal.dot(at - match.target);
  const double deviation = match.cloth ? weights.cloth : weights.skin;
  const double outlier = match.cloth ? weights.cloth_outlier : weights.skin_outlier;
  const double variance = deviation * deviation;
  const double s = out * out / variance;
  const Robust robust =
      match.cloth && out > 0 ? Robust{s, 1} : geman_mcclure(s, outlier * outlier / variance);
  const double count = match.weight * weights.surface_points;
  return {out, count * robust.weight / variance, 0.5 * count * robust.value};
}

/// The normal equations of the variables that some matches share: a row at a time over all of
/// them, then into those of the frame.
class Shared {
 public:
  /// @param columns  increasing
  explicit Shared(std::vector<Index> columns)
      : columns_(std::move(columns)),
        gradient_(columns_.size(), 0),
        hessian_(columns_.size() * columns_.size(), 0) {}

  void add(const double* row, double residual, double weight) {
    const std::size_t size = columns_.size();
    for (std::size_t a = 0; a < size; ++a) {
      const double scaled = weight * row[a];
      gradient_[a] += scaled * residual;
      double* to = hessian_.data() + a * size;
      for (std::size_t b = 0; b <= a; ++b) {
        to[b] += scaled * row[b];
      }
    }
  }
  /// Into the lower half.
  void scatter(Normal& normal) const {
    const std::size_t size = columns_.size();
    for (std::size_t a = 0; a < size; ++a) {
      normal.gradient[columns_[a]] += gradient_[a];
      for (std::size_t b = 0; b <= a; ++b) {
        normal.hessian(columns_[a], columns_[b]) += hessian_[a * size + b];
      }
    }
  }

 private:
  std::vector<Index> columns_;
  std::vector<double> gradient_;
  std::vector<double> hessian_;
};

void add_matches(const FittedPerson& person, const FrameTargets& targets, const SkinPoints& matched,
                 const FrameWeights& weights, const Pose& pose, Index shape_column, double& cost,
                 Normal& normal) {
  const std::vector<SurfaceMatch>& matches = targets.matches;
  ATELIER_CHECK(matched.order.size() == matches.size(), "points of another frame");
  if (matches.empty()) {
    return;
  }
  const PosedBody posed = pose_joints(*person.model, person.shaped, pose);
  Points directions;
  if (normal.on()) {
    directions.resize(static_cast<Index>(matches.size()), 3);
    for (std::size_t m = 0; m < matches.size(); ++m) {
      directions.row(static_cast<Index>(m)) = matches[m].normal.transpose();
    }
  }
  const Eigen::MatrixXd by_shape = normal.on() && shape_column >= 0
                                       ? match_shape_rows(person, posed, matches)
                                       : Eigen::MatrixXd{};
  std::vector<double> row;
  visit_skin_points(person.shaped, posed, matched, directions, [&](const ChainRows& chain) {
    std::vector<Index> columns;
    if (normal.on()) {
      columns = {0, 1, 2};
      for (const int slot : chain.chain.slots) {
        columns.insert(columns.end(), {3 + 3 * slot, 4 + 3 * slot, 5 + 3 * slot});
      }
      for (Index s = 0; s < by_shape.cols(); ++s) {
        columns.push_back(shape_column + s);
      }
    }
    row.resize(columns.size());
    Shared shared(std::move(columns));
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const auto at = static_cast<Index>(i);
      const int m = chain.points[i];
      const MatchState state = match_state(matches[static_cast<std::size_t>(m)],
                                           chain.places.row(at).transpose(), weights);
      cost += state.cost;
      if (!normal.on() || state.weight <= 0) {
        continue;
      }
      if (by_shape.cols() == 0) {
        shared.add(chain.rows.row(at).data(), state.out, state.weight);
        continue;
      }
      Eigen::Map<Eigen::RowVectorXd> whole(row.data(), static_cast<Index>(row.size()));
      whole << chain.rows.row(at), by_shape.row(m);
      shared.add(row.data(), state.out, state.weight);
    }
    if (normal.on()) {
      shared.scatter(normal);
    }
  });
}

void add_priors(const FittedPerson& person, const FrameTargets& targets,
                const FrameWeights& weights, const Eigen::VectorXd& x, double& cost,
                Normal& normal) {
  const auto add = [&](Index i, double residual, double weight) {
    cost += 0.5 * weight * residual * residual;
    if (normal.on()) {
      normal.add(i, 1);
      normal.close(residual, weight);
    }
  };
  for (Index i = 0; i < x.size(); ++i) {
    if (person.stiffness[i] > 0) {
      add(i, x[i], targets.prior * person.stiffness[i] / (weights.rest_pull * weights.rest_pull));
    }
    const double beyond = x[i] < person.least[i]  ? x[i] - person.least[i]
                          : x[i] > person.most[i] ? x[i] - person.most[i]
                                                  : 0;
    if (beyond != 0) {
      add(i, beyond, 1 / (weights.limit * weights.limit));
    }
  }
}

}  // namespace

OptionTable describe(FrameWeights& weights) {
  OptionTable table;
  table.add("keypoint", weights.keypoint, 1e-4, 0.5, "m",
            "Standard deviation of a keypoint in space; 0.02 for few cameras");
  table.add("keypoint_outlier", weights.keypoint_outlier, 1e-3, 10, "m",
            "Distance beyond which a keypoint is down-weighted as an outlier");
  table.add("skin", weights.skin, 1e-4, 0.5, "m",
            "Standard deviation of a scan's skin about the body");
  table.add("skin_outlier", weights.skin_outlier, 1e-3, 10, "m",
            "Distance beyond which a point of skin is down-weighted as an outlier");
  table.add("cloth", weights.cloth, 1e-4, 0.5, "m",
            "Standard deviation of clothing about the body; larger for looser clothing");
  table.add("cloth_outlier", weights.cloth_outlier, 1e-3, 10, "m",
            "Depth inside of clothing beyond which it is down-weighted as an outlier");
  table.add("surface_points", weights.surface_points, 1, 1e6, "",
            "Number of independent points that a whole scan counts as, since errors of neighbours "
            "are correlated");
  table.add("rest_pull", weights.rest_pull, 0.01, 100, "rad",
            "Standard deviation of joint rotations about the rest pose; smaller regularises more");
  table.add("limit", weights.limit, 1e-3, 10, "rad",
            "Standard deviation of the excess over a joint limit; smaller makes limits harder");
  return table;
}

FittedPerson fitted_person(const BodyModel& model, const std::vector<std::string>& keypoint_names,
                           bool fingers) {
  const Humanoid who = recognised_humanoid(model.skeleton);
  FittedPerson person;
  person.model = &model;
  person.shaped = shape_body(model);
  person.chains = skin_chains(model);
  person.places = keypoint_places(model, keypoint_names);
  person.shape = neutral_shape(model);
  const std::size_t count = model.skeleton.names.size();
  person.slots.assign(count, -1);
  std::vector<double> stiffness(count, 0);
  for (const std::vector<int>* chain : {&who.spine, &who.neck}) {
    for (const int joint : *chain) {
      seek(person, joint, kTrunkFreedom, stiffness);
    }
  }
  for (std::size_t side = 0; side < 2; ++side) {
    const Leg& leg = who.legs[side];
    const Arm& arm = who.arms[side];
    for (const int joint : {leg.hip, leg.knee, arm.shoulder, arm.elbow}) {
      seek(person, joint, 1, stiffness);
    }
    for (const int joint : {leg.ankle, leg.toe, arm.collar, arm.wrist}) {
      seek(person, joint, kEndFreedom, stiffness);
    }
    if (fingers) {
      for (const auto& chain : arm.fingers) {
        for (const int joint : chain) {
          seek(person, joint, kFingerFreedom, stiffness);
        }
      }
    }
  }
  person.slots[0] = 0;
  stiffness[0] = 0;
  for (std::size_t j = 0; j < count; ++j) {
    if (person.slots[j] >= 0) {
      person.slots[j] = static_cast<int>(person.joints.size());
      person.joints.push_back(static_cast<int>(j));
    }
  }
  const Index size = 3 + 3 * static_cast<Index>(person.joints.size());
  const double infinite = std::numeric_limits<double>::infinity();
  person.least = Eigen::VectorXd::Constant(size, -infinite);
  person.most = Eigen::VectorXd::Constant(size, infinite);
  person.stiffness = Eigen::VectorXd::Zero(size);
  for (std::size_t a = 1; a < person.joints.size(); ++a) {
    const int joint = person.joints[a];
    const Index at = 3 + 3 * static_cast<Index>(a);
    person.stiffness.segment<3>(at).setConstant(stiffness[static_cast<std::size_t>(joint)]);
    if (model.skeleton.limits_min.rows() > 0 && model.skeleton.limits_max.rows() > 0) {
      person.least.segment<3>(at) = model.skeleton.limits_min.row(joint).transpose();
      person.most.segment<3>(at) = model.skeleton.limits_max.row(joint).transpose();
    }
  }
  return person;
}

Eigen::VectorXd pose_variables(const FittedPerson& person, const Pose& pose) {
  Eigen::VectorXd x(3 + 3 * static_cast<Index>(person.joints.size()));
  x.head<3>() = pose.root_translation;
  for (std::size_t a = 0; a < person.joints.size(); ++a) {
    x.segment<3>(3 + 3 * static_cast<Index>(a)) = pose.rotations.row(person.joints[a]).transpose();
  }
  return x;
}

Pose pose_of_variables(const FittedPerson& person, const Eigen::VectorXd& x) {
  ATELIER_CHECK(x.size() == 3 + 3 * static_cast<Index>(person.joints.size()),
                "variables of another person");
  Pose pose = rest_pose(person.shaped.skeleton);
  pose.root_translation = x.head<3>();
  for (std::size_t a = 0; a < person.joints.size(); ++a) {
    pose.rotations.row(person.joints[a]) = x.segment<3>(3 + 3 * static_cast<Index>(a)).transpose();
  }
  return pose;
}

FittedPerson with_shape(FittedPerson person, const Eigen::VectorXd& shape) {
  const BodyModel& model = *person.model;
  check_shape(model, shape);
  if (person.places_by_shape.size() != model.shape.size()) {
    // Where a ray or a furthest vertex finds a place has no derivative worth the name: a difference
    // over a tenth of the plausible range.
    person.places_by_shape.clear();
    const Eigen::VectorXd middle = neutral_shape(model);
    const KeypointPlaces before = keypoint_places(model, person.places.names);
    for (std::size_t s = 0; s < model.shape.size(); ++s) {
      const double step = 0.1 * (model.shape[s].max - model.shape[s].min);
      Eigen::VectorXd moved = middle;
      moved[static_cast<Index>(s)] += step;
      person.places_by_shape.emplace_back(
          (keypoint_places(at_shape(model, moved), person.places.names).riding.offsets -
           before.riding.offsets) /
          step);
    }
    person.shape = middle;
  }
  for (std::size_t s = 0; s < model.shape.size(); ++s) {
    const auto i = static_cast<Index>(s);
    person.places.riding.offsets += (shape[i] - person.shape[i]) * person.places_by_shape[s];
  }
  person.shape = shape;
  person.shaped = shape_body(model, shape);
  return person;
}

namespace {

FrameEnergy energy_of(const FittedPerson& person, const FrameTargets& targets,
                      const SkinPoints& matched, const Eigen::VectorXd& x,
                      const FrameWeights& weights, bool derivatives, Index shape_count) {
  ATELIER_CHECK(
      targets.keypoints.rows() == targets.deviations.size() &&
          targets.keypoints.rows() <= static_cast<Index>(person.places.riding.joints.size()),
      "keypoints as the person was prepared for");
  const Pose pose = pose_of_variables(person, x);
  const JointFrames frames = forward_kinematics(person.shaped.skeleton, pose);
  const std::vector<Eigen::Matrix3d> bases =
      derivatives ? joint_velocity_bases(person.shaped.skeleton, pose, frames)
                  : std::vector<Eigen::Matrix3d>{};
  FrameEnergy energy;
  Normal normal(x.size() + shape_count, derivatives);
  const Index shape_column = shape_count > 0 ? x.size() : -1;
  add_keypoints(person, targets, weights, frames, bases, shape_column, energy.cost, normal);
  add_matches(person, targets, matched, weights, pose, shape_column, energy.cost, normal);
  add_priors(person, targets, weights, x, energy.cost, normal);
  if (derivatives) {
    normal.finish();
    energy.gradient = std::move(normal.gradient);
    energy.hessian = std::move(normal.hessian);
  }
  return energy;
}

}  // namespace

SkinPoints matched_points(const FittedPerson& person, const FrameTargets& targets) {
  FacePoints points;
  points.barycentric.resize(static_cast<Index>(targets.matches.size()), 3);
  for (const SurfaceMatch& match : targets.matches) {
    points.barycentric.row(static_cast<Index>(points.vertices.size())) =
        match.barycentric.transpose();
    points.vertices.push_back(match.vertices);
  }
  return skin_points(*person.model, person.chains, person.slots, points);
}

FrameEnergy frame_energy(const FittedPerson& person, const FrameTargets& targets,
                         const Eigen::VectorXd& x, const FrameWeights& weights, bool derivatives) {
  return frame_energy(person, targets, matched_points(person, targets), x, weights, derivatives);
}

FrameEnergy frame_energy(const FittedPerson& person, const FrameTargets& targets,
                         const SkinPoints& matched, const Eigen::VectorXd& x,
                         const FrameWeights& weights, bool derivatives) {
  return energy_of(person, targets, matched, x, weights, derivatives, 0);
}

FrameEnergy frame_shape_energy(const FittedPerson& person, const FrameTargets& targets,
                               const Eigen::VectorXd& x, const FrameWeights& weights) {
  ATELIER_CHECK(person.places_by_shape.size() == person.model->shape.size(),
                "a person that has been through with_shape");
  return energy_of(person, targets, matched_points(person, targets), x, weights, true,
                   static_cast<Index>(person.model->shape.size()));
}

Eigen::VectorXd sought_joints(const FittedPerson& person, const Eigen::VectorXd& x) {
  const JointFrames frames =
      forward_kinematics(person.shaped.skeleton, pose_of_variables(person, x));
  Eigen::VectorXd places(3 * static_cast<Index>(person.joints.size()));
  for (std::size_t a = 0; a < person.joints.size(); ++a) {
    places.segment<3>(3 * static_cast<Index>(a)) =
        frames.positions.row(person.joints[a]).transpose();
  }
  return places;
}

Eigen::MatrixXd sought_joints_jacobian(const FittedPerson& person, const Eigen::VectorXd& x) {
  const Skeleton& skeleton = person.shaped.skeleton;
  const Pose pose = pose_of_variables(person, x);
  const JointFrames frames = forward_kinematics(skeleton, pose);
  const std::vector<Eigen::Matrix3d> bases = joint_velocity_bases(skeleton, pose, frames);
  const auto count = static_cast<Index>(person.joints.size());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * count, x.size());
  for (Index a = 0; a < count; ++a) {
    const int joint = person.joints[static_cast<std::size_t>(a)];
    jacobian.block<3, 3>(3 * a, 0).setIdentity();
    for (int above = skeleton.parents[static_cast<std::size_t>(joint)]; above >= 0;
         above = skeleton.parents[static_cast<std::size_t>(above)]) {
      const int slot = person.slots[static_cast<std::size_t>(above)];
      if (slot >= 0) {
        const Eigen::Vector3d arm =
            (frames.positions.row(joint) - frames.positions.row(above)).transpose();
        jacobian.block<3, 3>(3 * a, 3 + 3 * slot) =
            -cross_matrix(arm) * bases[static_cast<std::size_t>(above)];
      }
    }
  }
  return jacobian;
}

}  // namespace atelier
