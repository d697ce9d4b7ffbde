#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "capture/camera_readings.h"
#include "capture/dataset.h"
#include "capture/frame_reader.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "capture/triangulation.h"
#include "core/camera.h"
#include "core/finding.h"

namespace atelier {

/// Data that are compared: calibrations and one person's detections.
struct SeenPerson {
  std::vector<Camera> cameras;
  WorldConvention world_convention;  ///< in which the calibrations were written
  const KeypointSchema* schema = nullptr;
  double fps = 30;
  std::vector<int> frame_ids;                        ///< [F]
  std::vector<std::vector<Keypoints2d>> detections;  ///< [F][camera], [K,3] or no rows
};

/// The person that is detected best in some frames of a calibrated capture whose order of keypoints
/// is known, and what was found while its detections were read.
/// @param frame_ids  frames to read
SeenPerson read_person(FrameReader& reader, const std::vector<int>& frame_ids,
                       const TriangulationOptions& options, std::vector<Finding>& findings);

/// Of detections that are asked.
inline constexpr double kConfidentDetection = 0.3;

/// Cameras that detect a point confidently, of one frame's detections [camera].
int confident_views(const std::vector<Keypoints2d>& cameras, std::size_t point);

/// A camera under a reading (camera_readings.h) of what the layout's files say; as it is under one
/// of keypoints.
Camera camera_read_as(const Camera& camera, const WorldConvention& world, const Reading& reading);

/// A camera's detections under a reading of keypoints; as they are under another.
Keypoints2d rows_read_as(const Keypoints2d& rows, const SeenPerson& seen, const Camera& camera,
                         const Reading& reading);

/// "--capture.extrinsics cam3=inverse".
std::string setting_of(std::string_view option, const std::string& camera, std::string_view value);

/// Whether errors are less by more than chance makes them: the sum of the differences is beyond
/// four of its standard deviations, of twenty and more. Under no difference each is as often for as
/// against, so that the sum deviates by the root of the squares. Negative values are unknown.
bool surely_less(const std::vector<double>& then, const std::vector<double>& now);

}  // namespace atelier
