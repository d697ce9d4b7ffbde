#pragma once

#include <optional>
#include <vector>

#include "capture/dataset.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "capture/triangulation.h"
#include "core/camera.h"
#include "core/finding.h"

namespace atelier {

/// What is held against each other: calibrations and one person's detections.
struct SeenPerson {
  std::vector<Camera> cameras;
  FileWorld file_world;  ///< in which the calibrations were written
  const KeypointSchema* schema = nullptr;
  double fps = 30;
  std::vector<int> frame_ids;                        ///< [F]
  std::vector<std::vector<Keypoints2d>> detections;  ///< [F][camera], [K,3] or no rows
};

/// The reading (camera_readings.h) under which all cameras fit together, where they do not as they
/// were read: triangulates some frames under each. Nothing if none makes them fit.
/// O(readings x cameras^3).
std::optional<Finding> explain_all(const SeenPerson& seen, const TriangulationOptions& options);

/// The reading under which all cameras fit clearly better although they fit as they are: an order
/// or a scale of distortion that bends the rim alone.
std::optional<Finding> explain_distortion(const SeenPerson& seen,
                                          const TriangulationOptions& options);

/// What is wrong with each camera whose detections miss the person that the others see: another
/// camera's calibration ("camera-mislabelled"), a reading that fits, a few frames too late or too
/// early ("camera-out-of-sync"), from some frame on ("camera-drops-frames"), a camera that was
/// pushed ("camera-moved"), or none of these ("camera-off"). `found` is what triangulate gave.
std::vector<Finding> explain_cameras(const SeenPerson& seen, const Triangulation& found);

/// Pixels by which all detections lie off all calibrations together, and how well that is known
/// (standard deviation): of all that the points in space cannot take up. Half a pixel is the
/// difference of the two conventions of where pixels begin.
struct CommonShift {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();      ///< px
  Eigen::Vector2d deviation = Eigen::Vector2d::Zero();  ///< px
};
std::optional<CommonShift> common_shift(const SeenPerson& seen, const Triangulation& found);

}  // namespace atelier
