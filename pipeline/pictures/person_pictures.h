#pragma once

#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "core/image.h"

namespace atelier {

/// One number of each frame.
struct FrameSeries {
  std::string label;           ///< "deviation, mm"
  std::vector<double> values;  ///< [F], of at least 0
};

/// The body at rest from the front and the back, some of its vertices in another colour, and under
/// it what they are. Linear RGB.
Image region_picture(const BodyModel& model, const std::vector<int>& vertices,
                     const std::string& caption);

/// Bars over frames, a panel for each series with its largest value written, bars of frames that
/// are not trusted in red. Linear RGB. Throws LogicError unless every series and `trusted` have a
/// value for each frame.
Image frames_picture(const std::vector<int>& frame_ids, const std::vector<char>& trusted,
                     const std::vector<FrameSeries>& series);

}  // namespace atelier
