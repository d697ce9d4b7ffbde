#pragma once

#include "capture/dataset.h"
#include "core/limits.h"

namespace atelier {

/// What the clocks of a capture's videos say beside the numbers of their frames, which count the
/// images of each from 0: images that are missing or come unevenly (video_findings), other rates
/// ("video-rates"), and a start that is later than that of others by half an interval and more
/// ("video-start"), unless offsets were given. Of cameras whose images are in a video that says
/// when they are shown; one that cannot be read is told of elsewhere.
std::vector<Finding> compare_video_clocks(const Dataset& dataset, const Limits& limits = {});

}  // namespace atelier
