#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/formats/marker_pose.h"

namespace atelier {

/// Where the keypoints of detectors ride on a body.
struct KeypointPlaces {
  std::vector<std::string> names;  ///< [K]
  RidingMarkers riding;            ///< [K] joint (-1: not known on this body) and place, metres
  Eigen::VectorXd spread;          ///< [K] metres by which detectors and bodies differ about it
};

/// Places of keypoints by name: those of BODY_25, COCO, HALPE, BlazePose and COCO-WholeBody without
/// the face's 68 ("nose", "left_ear", "left_knee", "neck", "mid_hip", "left_big_toe",
/// "left_index_2", ...). Joints are the model's own; nose, eyes and ears, toes and heels are found
/// on its surface, hence at any proportions: the point of a part that goes furthest in a direction,
/// or what a ray from the front meets at the height of the eyes. Names that mean nothing get joint
/// -1. Throws DataError for a body that is no person. O(names x V).
KeypointPlaces keypoint_places(const BodyModel& model, const std::vector<std::string>& names);

}  // namespace atelier
