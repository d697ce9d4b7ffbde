#pragma once

#include <string>
#include <vector>

#include "core/store/stage.h"
#include "registration/tracking/followed_frame.h"

namespace atelier {

/// Keeps what `register` has followed of one garment in the run's scratch folder, a file a frame:
/// `<garment>/<frame>.h5`, and a lock beside it while somebody follows it. So a run that goes on,
/// or a shard beside this one, finds what is done in a window that is not. A file that is damaged
/// or was made of something else is said to be so, removed and made again.
/// @param run, frame_ids  must outlive it; a frame's row is its place in frame_ids
FrameKeeping kept_frames(StageRun& run, const std::string& garment,
                         const std::vector<int>& frame_ids);

/// How many frames of a garment are kept so.
int kept_count(StageRun& run, const std::string& garment, const std::vector<int>& frame_ids);

}  // namespace atelier
