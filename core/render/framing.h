#pragma once

#include <vector>

#include "core/camera.h"
#include "core/mesh.h"
#include "core/options.h"

namespace atelier {

/// Where the viewer stands, seen from the subject: radians. Azimuth 0 is in front of a subject that
/// looks to +Z, pi/2 at its left hand (+X); elevation 0 is level, pi/2 straight above.
struct View {
  double azimuth = 0;
  double elevation = 0;
};

inline constexpr View kFront{0, 0.08};
inline constexpr View kThreeQuarter{0.6, 0.15};
inline constexpr View kSide{1.5707963267948966, 0.08};
inline constexpr View kBack{3.141592653589793, 0.08};

/// The same view of a subject that looks to `facing`, of which only its direction along the ground
/// counts; to +Z where it has none.
View turned(const View& view, const Eigen::Vector3d& facing);

struct FramingOptions {
  double field_of_view =
      0.49;              ///< of the image's longer side, radians, in (0, 3); 0.49: a portrait lens
  double margin = 0.06;  ///< left free on each side, share of the image, in [0, 0.45]
};

OptionTable describe(FramingOptions& options);

/// A camera from which all points lie just inside the image. Throws LogicError if there is no point
/// or options or sizes are out of range. One pass over the points.
Camera camera_around(const Points& points, const View& view, int width, int height,
                     const FramingOptions& options = {});

/// `count` cameras all the way round at one distance, from `start` on, for a turntable that does
/// not breathe. Throws as camera_around.
std::vector<Camera> turntable_cameras(const Points& points, const View& start, int count, int width,
                                      int height, const FramingOptions& options = {});

}  // namespace atelier
