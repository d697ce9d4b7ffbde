#pragma once

#include <vector>

#include "capture/seen_person.h"
#include "capture/triangulation.h"
#include "core/finding.h"

namespace atelier {

/// The error of each camera whose detections miss the person that the others see: another camera's
/// calibration ("camera-mislabelled"), a reading that fits, images that were turned since
/// ("camera-turned"), a few frames too late or too early
/// ("camera-out-of-sync"), from some frame on ("camera-drops-frames"), a camera that was pushed
/// ("camera-moved"), or none of these ("camera-off"). `found` is what triangulate gave.
std::vector<Finding> explain_cameras(const SeenPerson& seen, const Triangulation& found);

}  // namespace atelier
