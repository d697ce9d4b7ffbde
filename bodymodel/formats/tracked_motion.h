#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/limits.h"
#include "core/pose.h"
#include "core/skeleton.h"
#include "core/tensor.h"

namespace atelier {

/// A person's poses found in a capture: what the stage `track` makes and `body` reads.
struct TrackedMotion {
  Skeleton skeleton;           ///< of the person, [J]
  Motion motion;               ///< [F] frames with the capture's own numbers
  std::vector<Points> joints;  ///< [F] of [J,3] metres, where the joints are
  RowMatrix deviations;        ///< [F,J] metres, standard deviation of each joint's place (root of
                               ///< the mean of its variances along the three axes)
  std::vector<char> trusted;  ///< [F] 0: too little was seen or it did not agree, and the frame was
                              ///< bridged from those around it, or its pose misses what was seen
  Eigen::VectorXd keypoint_rms;  ///< [F] metres between keypoints and where the fit has them; 0
                                 ///< without keypoints
  Eigen::VectorXd scan_rms;      ///< [F] metres between the scan's points that counted and the
                                 ///< body's surface; 0 without a scan
  Eigen::VectorXd scan_share;    ///< [F] share of the scan's points that counted
  std::vector<int> region;       ///< vertices of the body whose clothing was left out, increasing
};

/// Throws DataError unless skeleton and poses are valid, frame ids increase, arrays have the stated
/// sizes and finite numbers, and deviations are not negative.
void check_tracked_motion(const TrackedMotion& tracked, const std::string& file = "");

/// HDF5 of schema "atelier.tracked", version 1 (docs/reference/formats.md), and back. Throws
/// DataError for arrays that are missing, of another shape or out of range.
Archive archive_of(const TrackedMotion& tracked);
TrackedMotion tracked_motion_of(const Archive& archive, const std::string& file = "");

void write_tracked_motion(const std::filesystem::path& path, const TrackedMotion& tracked);
TrackedMotion read_tracked_motion(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
