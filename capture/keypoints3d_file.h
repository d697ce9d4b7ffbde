#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "capture/keypoints2d.h"
#include "capture/triangulation.h"
#include "core/limits.h"

namespace atelier {

/// The people of one JSON of keypoints in space, in the file's own unit and axes: EasyMocap's
/// `keypoints3d/<frame>.json` (a list of {id, keypoints3d: [[x, y, z, c], ...]}) or CMU Panoptic's
/// `body3DScene_<frame>.json` ({bodies: [{id, joints19: [x, y, z, c, ...]}]}). Confidences of
/// points that were not found are -1 there and 0 here. Throws DataError for anything else and for
/// points at 1e9 or beyond.
std::vector<PersonPoints> parse_keypoints3d(std::string_view text, const std::string& file = "",
                                            const Limits& limits = {});

/// The list `deviations` of each person of EasyMocap's form, metres, by id: of files that
/// `keypoints3d_json` wrote of PersonPose. People without one, or with one of another length than
/// their points, are not in it. Throws DataError for negative ones and what is no such file.
std::map<int, std::vector<double>> parse_keypoint_deviations(std::string_view text,
                                                             const std::string& file = "",
                                                             const Limits& limits = {});

/// The list `bridged` of each person of EasyMocap's form, by id: numbers of the points that no view
/// saw, which lie between the frames before and after. People without one are not in it. Throws
/// DataError for numbers that no point has and what is no such file.
std::map<int, std::vector<int>> parse_bridged_keypoints(std::string_view text,
                                                        const std::string& file = "",
                                                        const Limits& limits = {});

/// EasyMocap's form.
std::string keypoints3d_json(const std::vector<PersonPoints>& people);

/// One person as `triangulate` gives it.
struct PersonPose {
  int id = -1;
  SpacePose pose;
};

/// The same form with two lists more for each person: `bridged`, the numbers of the points that no
/// view saw, and `deviations`, m, of each point (the root of the mean of its variances; 0 where it
/// was not found).
std::string keypoints3d_json(const std::vector<PersonPose>& people);

}  // namespace atelier
