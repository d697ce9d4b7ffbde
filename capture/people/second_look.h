#pragma once

#include <cstddef>
#include <vector>

#include "capture/detection/find_people.h"
#include "capture/keypoints2d.h"
#include "core/camera.h"

namespace atelier {

/// People of several cameras: [camera][frame], no people where a camera has no image.
using PeopleInViews = std::vector<std::vector<PeopleInImage>>;

/// The order of the built-in detector's points.
inline constexpr const char* kBuiltInSchema = "blazepose_33";

/// A detection's points as a capture's files hold them: below `threshold`, and beyond the image,
/// they were not found.
Keypoints2d found_points(const PersonLandmarks& person, int width, int height, double threshold);

/// A view that disagrees with the others, or lacks somebody whom they see.
struct SecondLook {
  Index camera = 0;
  std::size_t frame = 0;
  int person = -1;       ///< place among the image's people; -1: not found there
  double error = 0;      ///< px of an image 1000 rows high, of what was found; -1: nothing was
  PersonCrop crop;       ///< where the others see the person
  Keypoints2d expected;  ///< [33,3] px, what the others see, projected; 0, 0, 0: they do not
};

struct SecondLookOptions {
  double threshold = 0.1;  ///< visibility of a point that is used
  double agree = 30;  ///< px of an image 1000 rows high: median error above which a view disagrees
  double fps = 30;
};

/// Triangulates everybody in each frame by all views (triangulate, associate_people) and compares
/// each view with what that projects to. Where a whole person fits mirrored and not as found, left
/// and right are exchanged in `people`, and `mirrored` counts it. Our choice.
/// @param people  as find_people returned them, a sequence for each camera
/// Throws LogicError for sizes that differ.
std::vector<SecondLook> second_looks(const std::vector<Camera>& cameras, PeopleInViews& people,
                                     const SecondLookOptions& options, int& mirrored);

/// Takes what was found in a second look's crop if it agrees with the other views better than what
/// was there; whether it was taken.
bool take_second_look(const SecondLook& look, const PersonLandmarks& found, const Camera& camera,
                      const SecondLookOptions& options, double min_presence, PeopleInViews& people);

}  // namespace atelier
