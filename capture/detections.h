#pragma once

#include <vector>

#include "capture/frame_reader.h"
#include "core/finding.h"

namespace atelier {

/// Everybody who was found in some frames, in every camera.
struct Detections {
  std::vector<int> frame_ids;                                     ///< [F]
  std::vector<std::vector<std::vector<PersonKeypoints>>> people;  ///< [F][camera][person]
  std::vector<Finding> findings;  ///< "keypoints-damaged", "keypoint-count": these were left out
};

/// Reads the detections of these frames. A file that is damaged, and people with other numbers of
/// points than the schema, are findings and count as nobody there.
Detections read_detections(FrameReader& reader, const std::vector<int>& frames);

/// The person with the most confident points of each camera and frame: [frame][camera]; no rows
/// where nobody was found.
std::vector<std::vector<Keypoints2d>> main_person(const Detections& detections);

/// Most people in one image.
int max_people(const Detections& detections);

}  // namespace atelier
