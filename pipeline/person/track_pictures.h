#pragma once

#include <array>
#include <string>

#include "pipeline/row/key_figure.h"
#include "pipeline/row/report_places.h"

namespace atelier {

/// Plots by which a result is judged without a ground truth, with limits as lines.
inline constexpr std::array kTrackFigures = {
    KeyFigure{"trusted_share", "share of frames with a trusted pose", Measure::Side::AtLeast, 0.95},
    KeyFigure{"keypoint_rms", "distance of the tracked body from the keypoints, rms",
              Measure::Side::AtMost, 0.02},
};

/// The skeleton over images, and how well each frame of each tracked sequence is founded.
std::string track_pictures(const StageStatus& own, const ReportPlaces& places);

}  // namespace atelier
