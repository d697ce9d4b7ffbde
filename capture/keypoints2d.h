#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/limits.h"
#include "core/types.h"

namespace atelier {

/// One person's keypoints in one image: pixels and confidence; what was not found is 0, 0, 0.
using Keypoints2d = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// One person's keypoints in space: metres and confidence; what was not found is 0, 0, 0, 0.
using Keypoints3d = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

/// Detections of one person in one image.
struct PersonKeypoints {
  int id = -1;         ///< the file's number of the person; -1: none, the order means nothing
  Keypoints2d points;  ///< [K,3] px (the first pixel's centre at (0.5, 0.5)) and confidence
};

/// One person in space.
struct PersonPoints {
  int id = -1;         ///< as above
  Keypoints3d points;  ///< [K,4] metres and confidence
};

/// The people of one OpenPose JSON (doc/02_output.md; also what pose2sim and rtmlib write):
/// `people`, each with `pose_keypoints_2d` and `person_id`. Face and hands,
/// which BODY_25 files hold in arrays of their own, are not read; 133 points of COCO-WholeBody
/// stand in `pose_keypoints_2d`. A keypoint with NaN, as Python writes it, was not found. Throws
/// DataError for anything that is no such JSON, arrays that are no triples, people with different
/// numbers of points, points at 1e6 px or beyond. Confidences are read as they are.
/// @param shift  px, added to what was found: 0.5 where the file counts from the first pixel's
/// centre
std::vector<PersonKeypoints> parse_openpose(std::string_view text, const std::string& file = "",
                                            double shift = 0, const Limits& limits = {});

/// The people of one image in the words of whichever program found them: OpenPose's (above),
/// MMPose's (`instance_info` of one frame, or the list of instances that its inferencer writes:
/// `keypoints` as rows of x and y with `keypoint_scores`; so does RTMPose) or AlphaPose's (a list
/// of `keypoints` as triples) or of a data set of COCO (`annotations` of `images`). Throws as
/// parse_openpose, and for a file of several frames.
std::vector<PersonKeypoints> parse_detections(std::string_view text, const std::string& file = "",
                                              double shift = 0, const Limits& limits = {});

/// The people of each frame of a file that holds many: MMPose's with `frame_id`, AlphaPose's with
/// `image_id` (the last number of the image's name) or an object of images, COCO's data sets (the
/// last number of `file_name`; frames without people are there and empty, visibility 2 is a
/// confidence of 1). Throws as above.
std::map<int, std::vector<PersonKeypoints>> parse_detection_frames(std::string_view text,
                                                                   const std::string& file = "",
                                                                   double shift = 0,
                                                                   const Limits& limits = {});

/// The people of one EasyMocap annotation (`annots/<camera>/<frame>.json`): `annots`, or the bare
/// list, each with `keypoints` and `personID` or `id`. Throws as parse_openpose.
std::vector<PersonKeypoints> parse_easymocap_annotation(std::string_view text,
                                                        const std::string& file = "",
                                                        double shift = 0.5,
                                                        const Limits& limits = {});

/// OpenPose's JSON of these people, shortest numbers that read back to the same.
/// @param shift  px, taken off what was found
std::string openpose_json(const std::vector<PersonKeypoints>& people, double shift = 0);

}  // namespace atelier
