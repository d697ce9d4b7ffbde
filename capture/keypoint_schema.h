#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/keypoints2d.h"

namespace atelier {

/// An order of 2D keypoints, as detectors write them.
struct KeypointSchema {
  std::string name;                 ///< "body_25", "body_25b", "coco_17", ...
  std::vector<std::string> points;  ///< snake_case: "nose", "left_shoulder", "face_17", ...
  std::vector<int> mirror;          ///< the point on the other side; itself in the middle
};

/// BODY_25 of OpenPose: 25 points.
const KeypointSchema& body_25_schema();

/// COCO-WholeBody: 17 of the body, 6 of the feet, 68 of the face (iBUG order), 21 of each hand
/// (wrist, then four of each finger from the thumb): 133 points.
const KeypointSchema& coco_wholebody_schema();

/// Every schema by name: "body_25", "body_25b" (OpenPose's later order of as many points),
/// "coco_17", "coco_18" (OpenPose's COCO: with a neck), "halpe_26" (pose2sim, RTMPose),
/// "coco_wholebody", "coco_19" (CMU Panoptic, in space) and "blazepose_33" (the built-in detector,
/// MediaPipe).
const std::vector<std::string>& keypoint_schema_names();

/// By name. Throws DataError for an unknown one, with the nearest.
const KeypointSchema& keypoint_schema(std::string_view name);

/// Place of a point in a schema, -1 if it has none of that name.
int find_keypoint(const KeypointSchema& schema, std::string_view point);

/// How far a schema's limbs stretch over the points of one person, relative to their extent: the
/// mean length of the limbs whose two ends were found (confidence above `least`) divided by the
/// diagonal of all that was found. The right order gives the smallest (our choice): points in
/// another order are joined across the body. Nothing if fewer than four limbs were found.
/// Throws LogicError for another number of points than the schema's.
std::optional<double> limb_stretch(const KeypointSchema& schema, const Keypoints2d& points,
                                   double least = 0.3);

/// The schema of that many points under which `people` are put together best (limb_stretch, mean);
/// ties and no people: the first of keypoint_schema_names(). "" if no schema has as many points.
std::string guess_keypoint_schema(Index points, const std::vector<Keypoints2d>& people);

}  // namespace atelier
