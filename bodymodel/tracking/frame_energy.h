#pragma once

#include <array>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/skin_points.h"
#include "bodymodel/tracking/keypoint_places.h"
#include "core/options.h"

namespace atelier {

/// How much each kind of evidence of a pose counts. Every residual is divided by its standard
/// deviation, so that these are all in metres and radians.
struct FrameWeights {
  double keypoint = 0.008;  ///< m, noise of a keypoint in space, [1e-4, 0.5]; 0.02 suits single
                            ///< detectors on few cameras
  double keypoint_outlier = 0.06;  ///< m beyond which a keypoint counts less and less, [1e-3, 10]
  double skin = 0.004;             ///< m, noise of a scan's skin about the body, [1e-4, 0.5]
  double skin_outlier = 0.03;      ///< m beyond which a point of skin counts less, [1e-3, 10]
  double cloth = 0.012;  ///< m, how clothing lies about the body, [1e-4, 0.5]; larger: looser wear
  double cloth_outlier = 0.06;  ///< m inside of clothing beyond which it pulls less, [1e-3, 10]
  double surface_points = 300;  ///< as how many independent points a whole scan counts, [1, 1e6]:
                                ///< neighbours err alike
  double rest_pull = 1.0;       ///< rad, spread of rotations about rest, [0.01, 100]
  double limit = 0.05;          ///< rad, by which a joint's limit gives, [1e-3, 10]
};
OptionTable describe(FrameWeights& weights);

/// A person ready to be fitted to frames: all that does not change from frame to frame.
struct FittedPerson {
  const BodyModel* model = nullptr;  ///< without shape parameters or at its neutral shape
  ShapedBody shaped;
  SkinChains chains;
  KeypointPlaces places;
  std::vector<int> joints;    ///< [A] whose rotations are sought, increasing; others stay at rest
  std::vector<int> slots;     ///< [J] which of `joints` it is, -1 if it is not sought
  Eigen::VectorXd least;      ///< [3+3A] limits of the variables; infinite where there are none
  Eigen::VectorXd most;       ///< [3+3A]
  Eigen::VectorXd stiffness;  ///< [3+3A] factor on the pull to rest
  Eigen::VectorXd shape;      ///< [S] values at which `shaped` and `places` are
  std::vector<Points> places_by_shape;  ///< [S] of [K,3], change of the places per unit of a value
};

/// Prepares a person: the joints of trunk, head, limbs, and with `fingers` those of the hands.
/// The model must outlive the result. Throws DataError for a body that is no person.
FittedPerson fitted_person(const BodyModel& model, const std::vector<std::string>& keypoint_names,
                           bool fingers = false);

/// The same person at another shape [S]; keypoints on the skin move with it to first order, by
/// `places_by_shape`, which is made here if it is not there yet. O(V S).
FittedPerson with_shape(FittedPerson person, const Eigen::VectorXd& shape);

/// The variables of a pose: root translation, then the rotation vectors of `joints`; [3+3A]. And
/// the pose of variables, other joints at rest.
Eigen::VectorXd pose_variables(const FittedPerson& person, const Pose& pose);
Pose pose_of_variables(const FittedPerson& person, const Eigen::VectorXd& x);

/// A point of the body's surface and the plane of the scan that it should lie in.
struct SurfaceMatch {
  std::array<int, 3> vertices = {0, 0, 0};
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit, out of the body
  Eigen::Vector3d target = Eigen::Vector3d::Zero();   ///< metres, point of the scan
  double weight = 1;                                  ///< share of a whole scan, [0, 1]
  bool cloth = false;  ///< clothing: the body may lie inside, not outside
};

/// Observations of one frame.
struct FrameTargets {
  Points keypoints;            ///< [K,3] metres
  Eigen::VectorXd deviations;  ///< [K] metres; 0: not seen. Added to FrameWeights::keypoint
  std::vector<SurfaceMatch> matches;
  double prior = 1;  ///< factor on the pull to rest; small where frames around know better
};

/// Half the sum of squared (robust) residuals, with gradient and Gauss-Newton's Hessian.
struct FrameEnergy {
  double cost = 0;
  Eigen::VectorXd gradient;  ///< [n], or empty
  Eigen::MatrixXd hessian;   ///< [n,n], or empty
};

/// Evaluates one frame at its variables. Residuals:
///  - keypoints: distance in space over its deviation, Geman-McClure;
///  - matches: distance along the normal; skin Geman-McClure both ways; clothing quadratic where
///    the body lies outside, Geman-McClure where it lies inside;
///  - joint limits: what is beyond, squared; rotations about rest, squared.
/// The gradient is exact; the Hessian leaves out second derivatives and the curvature of the robust
/// functions (Triggs et al., "Bundle adjustment: a modern synthesis", 2000). O(matches + K + J).
FrameEnergy frame_energy(const FittedPerson& person, const FrameTargets& targets,
                         const Eigen::VectorXd& x, const FrameWeights& weights,
                         bool derivatives = true);

/// The part of a frame's matches that does not depend on the pose, computed once for many
/// evaluations.
SkinPoints matched_points(const FittedPerson& person, const FrameTargets& targets);
/// The same with `matched` = matched_points(person, targets).
FrameEnergy frame_energy(const FittedPerson& person, const FrameTargets& targets,
                         const SkinPoints& matched, const Eigen::VectorXd& x,
                         const FrameWeights& weights, bool derivatives = true);

/// The same with derivatives by the variables and, behind them, by the shape of `person`, which has
/// been through `with_shape`: gradient [n+S], Hessian [n+S,n+S].
FrameEnergy frame_shape_energy(const FittedPerson& person, const FrameTargets& targets,
                               const Eigen::VectorXd& x, const FrameWeights& weights);

/// Joint places at variables, [3A] in order of `joints`, and their Jacobian [3A, 3+3A].
Eigen::VectorXd sought_joints(const FittedPerson& person, const Eigen::VectorXd& x);
Eigen::MatrixXd sought_joints_jacobian(const FittedPerson& person, const Eigen::VectorXd& x);

}  // namespace atelier
