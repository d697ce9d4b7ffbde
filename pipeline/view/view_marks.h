#pragma once

#include <string>
#include <vector>

#include "pipeline/view/view_scene.h"

namespace atelier {

/// What a finding says of where it is: the number of a frame ("frame 12", "000012.png") of those
/// there are, and the camera whose id stands in it.
ViewMark mark_of(Severity severity, const std::string& text, const std::string& stage,
                 const std::vector<int>& frame_ids, const std::vector<std::string>& cameras);

}  // namespace atelier
