#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace atelier {

/// An order of 2D keypoints, as detectors write them.
struct KeypointSchema {
  std::string name;                 ///< "body_25", "coco_wholebody"
  std::vector<std::string> points;  ///< snake_case: "nose", "left_shoulder", "face_17", ...
  std::vector<int> mirror;          ///< the point on the other side; itself in the middle
};

/// BODY_25 of OpenPose: 25 points.
const KeypointSchema& body_25_schema();

/// COCO-WholeBody: 17 of the body, 6 of the feet, 68 of the face (iBUG order), 21 of each hand
/// (wrist, then four of each finger from the thumb): 133 points.
const KeypointSchema& coco_wholebody_schema();

/// By name. Throws DataError for an unknown one.
const KeypointSchema& keypoint_schema(std::string_view name);

/// Place of a point in a schema, -1 if it has none of that name.
int find_keypoint(const KeypointSchema& schema, std::string_view point);

}  // namespace atelier
