#pragma once

#include <string>
#include <vector>

#include "bodymodel/human/default_human.h"
#include "bodymodel/tracking/track.h"
#include "core/random.h"

namespace atelier::fixtures {

/// A person for these tests: the default human without a shape space.
const BodyModel& plain_human();

/// BODY_25.
const std::vector<std::string>& body_25_names();

/// The person, prepared.
const FittedPerson& fitted_human();

/// Keypoints of a pose, with Gaussian noise.
FrameTargets keypoints_of(const FittedPerson& person, const Eigen::VectorXd& x, double noise,
                          Random& random);

/// Someone who walks round in a circle and swings arms and legs.
Eigen::VectorXd walking(const FittedPerson& person, double seconds);

/// A pose with a joint turned about z, rad.
Eigen::VectorXd turned(Eigen::VectorXd x, const std::string& name, double angle);

/// The body of a pose itself as a scan of skin.
ScanPoints scan_of(const Eigen::VectorXd& x);

/// Mean distance of joints, metres.
double joint_error(const FittedPerson& person, const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace atelier::fixtures
