#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/camera.h"

namespace atelier {

/// Where most cameras look.
struct Gaze {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m
  std::vector<double> angle = {};                   ///< rad, [0, pi], of each camera off it
  int agreeing = 0;          ///< cameras that look past it by less than kLooksAt
  bool side_by_side = true;  ///< all look the same way, as cameras on a bar do
};
inline constexpr double kLooksAt = 0.610865;  // rad, 35 degrees: our choice

/// Of pairs of optical axes the place before both that most others pass (of two that face each
/// other the middle between them), then nearest to all axes that do (least squares). O(pairs x
/// cameras), at most 4,000 pairs.
Gaze gaze_of(const std::vector<Camera>& cameras);

/// One convention of the extrinsics of all cameras, and what the cameras alone say of it.
struct RigReading {
  std::string value;      ///< of "extrinsics" (camera_readings.h); "": as they were read
  bool possible = false;  ///< nearly all cameras look at one place, and are apart
  bool aimed = false;     ///< they look at it within 4 degrees, and nobody says what is up
  double doubt = 0;       ///< the less the likelier: sum of squares over what such rigs deviate by
};

/// A camera of our world under a value of "extrinsics"; "" leaves it.
Camera extrinsics_read_as(const Camera& camera, const WorldConvention& world,
                          const std::string& value);

/// Every convention of extrinsics, those that are possible first, then by their doubt: how far axes
/// miss the common place, how far cameras are tilted to the side against a common up direction, how
/// far that is off the one that the files are said to have, how near cameras are to each other.
/// Scales are our choice: on random rings, domes and arcs with deviations of aim and roll of up to
/// 7 and 5 degrees, the right one is first where it is the only one of `likely_values`.
std::vector<RigReading> rig_readings(const std::vector<Camera>& cameras,
                                     const WorldConvention& world);

/// Those that are not far more doubtful than the first, itself included: one where the cameras tell
/// the convention. Level cameras round a vertical axis of the files' world do not: with transposed
/// rotations they stand in the other order and look at one place as well. The reading as the files
/// are read stays among them where it is `aimed`: what is above cameras that hang as there was room
/// speaks against none.
std::vector<std::string> likely_values(const std::vector<RigReading>& readings);

}  // namespace atelier
