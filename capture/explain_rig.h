#pragma once

#include <optional>
#include <string>

#include "capture/seen_person.h"
#include "capture/triangulation.h"
#include "core/finding.h"

namespace atelier {

/// px: of a point that has no place in the image.
inline constexpr double kNowhere = 1000;

/// How well all cameras and detections fit together.
struct RigFit {
  double error = kNowhere;               ///< px at 1000 rows, median camera
  double share = 0;                      ///< of the detections, that support a point in space
  std::vector<double> unsupported = {};  ///< [frames x K]: share that does not, negative: unseen
  std::vector<double> points = {};       ///< px [frames x K]: error of each point, else negative
};
RigFit rig_fit(const SeenPerson& seen, const TriangulationOptions& options);

/// "87%, with 2.4 px of error"; "none" of detections that support nothing.
std::string fit_text(const RigFit& fit);

/// The reading (camera_readings.h) under which all cameras fit together, where they do not as they
/// were read: triangulates some frames under each. Nothing if none makes them fit.
/// O(readings x cameras^3).
std::optional<Finding> explain_all(const SeenPerson& seen, const TriangulationOptions& options);

/// The reading under which all cameras fit clearly better although they fit as they are: an order
/// or a scale of distortion that bends the rim alone.
std::optional<Finding> explain_distortion(const SeenPerson& seen,
                                          const TriangulationOptions& options);

/// Pixels by which all detections lie off all calibrations together, and how well that is known
/// (standard deviation): of all that the points in space cannot take up. Half a pixel is the
/// difference of the two conventions of where pixels begin. The deviation is that between cameras,
/// so that calibrations that are off by themselves tell nothing. Of six cameras and more.
struct CommonShift {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();      ///< px
  Eigen::Vector2d deviation = Eigen::Vector2d::Zero();  ///< px
};
std::optional<CommonShift> common_shift(const SeenPerson& seen, const Triangulation& found);

/// Cameras whose confident detections of a point lie within `most` px (of an image 1000 rows high)
/// of its place: unlike SpacePoint::views, of a camera that counts less too. 0 of none.
int agreeing_views(const SeenPerson& seen, std::size_t frame, std::size_t point,
                   const SpacePoint& place, double most);

/// Intrinsics of half the size and detections of twice the size make the same rays: the reading
/// that leaves the principal point near the middle is meant; whether one does not.
bool loses_centre(const Camera& before, const Camera& after);

}  // namespace atelier
