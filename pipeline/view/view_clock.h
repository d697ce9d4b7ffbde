#pragma once

#include <span>
#include <vector>

#include "capture/capture_info.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

/// Sets the frames of a timeline of a capture, and of layers whose frames have its numbers: each of
/// its sequences is a take of its own rate.
/// @param frame_ids  of the capture
void set_capture_frames(ViewTimeline& timeline, std::span<const CaptureSequence> sequences,
                        const std::vector<int>& frame_ids);

/// Sets the frames of a timeline of layers that have one rate, or several. Of several, those whose
/// numbers lie behind each other are takes, one after the other; others begin together, and each
/// shows the frame that is due at a time: then the frames are those of the fastest ones, which are
/// counted on for as long as another lasts (ViewLayer::begins). Where that would be more than a
/// million, frames are shown by their numbers.
void set_layer_frames(ViewTimeline& timeline);

}  // namespace atelier
