#include "capture/seen_person.h"

#include <algorithm>
#include <cmath>

#include "capture/associate_people.h"
#include "capture/camera_conventions.h"
#include "capture/detections.h"
#include "core/error.h"

namespace atelier {

SeenPerson read_person(FrameReader& reader, const std::vector<int>& frame_ids,
                       const TriangulationOptions& options, std::vector<Finding>& findings) {
  const Dataset& dataset = reader.dataset();
  SeenPerson seen;
  seen.cameras = dataset.cameras;
  seen.world_convention = dataset.world_convention;
  seen.schema = &keypoint_schema(dataset.info.keypoint_schema);
  seen.fps = dataset.info.sequences.empty() ? 30 : std::max(dataset.info.sequences[0].fps, 1.0);
  const Detections all = read_detections(reader, frame_ids);
  findings.insert(findings.end(), all.findings.begin(), all.findings.end());
  seen.frame_ids = all.frame_ids;
  seen.detections = main_person(all);
  if (max_people(all) > 1 && dataset.cameras.size() > 1) {
    const auto people = associate_people(dataset.cameras, all, *seen.schema, options);
    if (!people.empty()) {
      seen.detections = people.front();
    }
  }
  return seen;
}

int confident_views(const std::vector<Keypoints2d>& cameras, std::size_t point) {
  int views = 0;
  for (const Keypoints2d& rows : cameras) {
    views += rows.rows() > 0 && rows(static_cast<Index>(point), 2) > kConfidentDetection ? 1 : 0;
  }
  return views;
}

Camera camera_read_as(const Camera& camera, const WorldConvention& world, const Reading& reading) {
  return reading.option == "keypoints"
             ? camera
             : in_our_world(read_as(in_file_world(camera, world), reading.option, reading.value),
                            world);
}

Keypoints2d rows_read_as(const Keypoints2d& rows, const SeenPerson& seen, const Camera& camera,
                         const Reading& reading) {
  return reading.option == "keypoints"
             ? read_as(rows, keypoint_reading(reading.value, camera.width, camera.height),
                       *seen.schema, camera.width, camera.height)
             : rows;
}

std::string setting_of(std::string_view option, const std::string& camera, std::string_view value) {
  std::string flag(option);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return "--capture." + flag + " " + camera + "=" + std::string(value);
}

bool surely_less(const std::vector<double>& then, const std::vector<double>& now) {
  ATELIER_CHECK(then.size() == now.size(), "errors of the same detections");
  constexpr double kDeviations = 4;
  constexpr int kFew = 20;
  double sum = 0;
  double squares = 0;
  int count = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] >= 0 && then[i] >= 0) {
      const double less = now[i] - then[i];
      sum += less;
      squares += less * less;
      ++count;
    }
  }
  return count >= kFew && sum > kDeviations * std::sqrt(squares);
}

}  // namespace atelier
