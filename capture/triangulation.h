#pragma once

#include <string>
#include <vector>

#include "capture/detector.h"
#include "capture/keypoint_schema.h"
#include "core/camera.h"
#include "core/finding.h"
#include "core/options.h"
#include "core/types.h"

namespace atelier {

/// How 3D keypoints are made of 2D ones. Pixels are those of an image 1000 rows high; others
/// scale.
struct TriangulationOptions {
  double min_confidence = 0.1;  ///< of a detection that is used, [0, 1]
  double sigma = 3;             ///< px, error of a confident detection, (0, 100]
  double inlier = 15;           ///< px: beyond it a detection does not support a point, (0, 1000]
  int min_views = 2;            ///< that support a point, [2, 1000]
  bool swaps = true;            ///< undo swaps of left and right within an image
  bool distances = true;        ///< keep those that bodies keep (keep_distances)
  double bridge = 0.25;         ///< s: longest gap that is bridged, flagged, [0, 10]
};
OptionTable describe(TriangulationOptions& options);

/// One keypoint in space.
struct SpacePoint {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();       ///< m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< m2
  double confidence = 0;  ///< 0: not found; else 0 to 1, of the detections that support it
  int views = 0;          ///< that support it
  double error = 0;       ///< px, root mean square over them
  bool bridged = false;   ///< no view saw it: between the frames before and after
};

/// One person in one frame.
struct SpacePose {
  std::vector<SpacePoint> points;  ///< [K] in the schema's order
  std::vector<int> swapped;        ///< cameras in whose image a left and a right limb were swapped
};

/// One keypoint from its detections, one row for each camera (0, 0, 0: none): the best of all pairs
/// of views by what the others say (MSAC, Torr and Zisserman 2000; exhaustive, so without chance),
/// refined by Gauss-Newton with Geman-McClure weights over all views; the covariance is the inverse
/// of the weighted normal matrix, scaled by the residuals where they are larger than `sigma` says.
/// Pairs of rays less than 3 degrees apart do not start a point. O(views^3).
/// @param scale  [C] factor on each camera's `sigma`, or empty: 1; large for one that is off
SpacePoint triangulate_point(const std::vector<Camera>& cameras, const Keypoints2d& detections,
                             const TriangulationOptions& options = {},
                             const std::vector<double>& scale = {});

/// A person's sequence in space, and what is wrong with cameras.
struct Triangulation {
  std::vector<SpacePose> frames;
  std::vector<double> camera_error;  ///< [C] px, median over what each camera saw
  std::vector<Finding> findings;     ///< "camera-off": its error stands out; it counts less
};

/// All keypoints of one person over a sequence. A second pass weights detections by the error that
/// those of their confidence have in the first (our choice: `sigma` and `inlier` are a guess of any
/// detector's, and under clothes too narrow), where there are 600 and more of them. A camera whose
/// error stands out from the others' (more than twice their median; of six cameras and fewer also
/// against what the others alone say) is named and counts less then; limbs that fit better mirrored
/// are swapped back; gaps are bridged by a straight line, with the covariance that such a line
/// deserves, and flagged.
/// @param detections  [frame][camera], [K,3] each, or no rows where nothing was found
/// Throws LogicError for sizes that differ.
Triangulation triangulate(const std::vector<Camera>& cameras,
                          const std::vector<std::vector<Keypoints2d>>& detections,
                          const KeypointSchema& schema, double fps,
                          const TriangulationOptions& options = {});

}  // namespace atelier
