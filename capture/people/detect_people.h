#pragma once

#include <functional>
#include <vector>

#include "capture/dataset.h"
#include "capture/detection/find_people.h"
#include "core/finding.h"

namespace atelier {

struct DetectPeopleOptions {
  FindPeopleOptions find;
  double threshold = 0.1;  ///< visibility below which a point was not found, [0, 1]
  bool views = true;       ///< look again where calibrated cameras disagree
  int memory = 4096;       ///< MB of one confined run, 64 to 1e6
};

/// Account of a detection.
struct PeopleCount {
  int images = 0;
  int people = 0;                 ///< over all images
  int looked_again = 0;           ///< views that the others disagreed with
  int settled = 0;                ///< of those, found then
  int mirrored = 0;               ///< people whose left and right were exchanged
  std::vector<Finding> findings;  ///< "image-broken": an image that could not be read
};

/// Finds the people in every image of a capture by the built-in detector (find_people), and, where
/// its cameras are calibrated, looks again where they disagree (second_look.h). The detector is
/// given images as their EXIF says to show them; what it finds is of the stored ones. A number of
/// frames is worked on together, of all cameras, in at most 1 GB of images. Images that cannot be
/// read are findings, and the rest goes on.
/// @param each  is told the people of each image, in the order of frames, then of cameras
/// Throws as find_people.
PeopleCount detect_people(
    const Dataset& dataset, const PeopleNetworks& networks, const DetectPeopleOptions& options,
    const std::function<void(Index camera, int frame, const PeopleInImage& people,
                             const ByteImage& image)>& each);

}  // namespace atelier
