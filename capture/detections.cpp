#include "capture/detections.h"

#include <algorithm>
#include <map>
#include <string>

#include "capture/keypoint_schema.h"
#include "core/error.h"

namespace atelier {

Detections read_detections(FrameReader& reader, const std::vector<int>& frames) {
  const Dataset& dataset = reader.dataset();
  const auto points =
      static_cast<Index>(keypoint_schema(dataset.info.keypoint_schema).points.size());
  Detections all;
  all.frame_ids = frames;
  struct Damage {
    Finding first;
    int count = 0;
  };
  std::map<std::pair<std::size_t, std::string>, Damage> damages;
  const auto damaged = [&](std::size_t camera, int frame, const std::string& code,
                           const std::string& what, const std::string& advice) {
    Damage& damage = damages[{camera, code}];
    if (damage.count++ == 0) {
      damage.first = {Severity::Error, code,
                      dataset.cameras[camera].id + " frame " + std::to_string(frame), what, advice};
    }
  };
  for (const int frame : frames) {
    auto& cameras = all.people.emplace_back(dataset.cameras.size());
    for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
      try {
        cameras[c] = reader.keypoints(static_cast<Index>(c), frame);
      } catch (const DataError& error) {
        damaged(c, frame, "keypoints-damaged", error.what(), "detect the frame again");
      }
      for (const PersonKeypoints& person : cameras[c]) {
        if (person.points.rows() != 0 && person.points.rows() != points) {
          damaged(c, frame, "keypoint-count",
                  std::to_string(person.points.rows()) + " points, " +
                      dataset.info.keypoint_schema + " has " + std::to_string(points),
                  "--capture.keypoint-schema says which order they are in");
          cameras[c].clear();
          break;
        }
      }
    }
  }
  for (auto& [key, damage] : damages) {
    if (damage.count > 1) {
      damage.first.what += " (and " + std::to_string(damage.count - 1) + " more of its frames)";
    }
    all.findings.push_back(std::move(damage.first));
  }
  return all;
}

std::vector<std::vector<Keypoints2d>> main_person(const Detections& detections) {
  std::vector<std::vector<Keypoints2d>> frames;
  for (const auto& cameras : detections.people) {
    std::vector<Keypoints2d>& views = frames.emplace_back(cameras.size(), Keypoints2d(0, 3));
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      double most = 0;
      for (const PersonKeypoints& person : cameras[c]) {
        const double sum = person.points.col(2).sum();
        if (sum > most) {
          most = sum;
          views[c] = person.points;
        }
      }
    }
  }
  return frames;
}

int max_people(const Detections& detections) {
  std::size_t most = 0;
  for (const auto& cameras : detections.people) {
    for (const auto& people : cameras) {
      most = std::max(most, people.size());
    }
  }
  return static_cast<int>(most);
}

}  // namespace atelier
