#pragma once

#include <filesystem>
#include <functional>

#include "core/image.h"
#include "core/options.h"
#include "core/types.h"

namespace atelier {

struct VideoOptions {
  double fps = 30;   ///< frames per second, [0.1, 1000]
  int quality = 20;  ///< x264's constant rate factor, [0, 51]; 20 is hard to tell from the source,
                     ///< 28 is small
};

OptionTable describe(VideoOptions& options);

/// Writes `count` frames as H.264 in MP4 (yuv420p, BT.709, index in front) that browsers play.
/// `frame(i)` gives linear RGB [height, width, 3] in [0,1], all of one size; an odd last row or
/// column is repeated once. The file appears whole or not at all (core/atomic_file.h). One encoder
/// thread: the same frames give the same bytes.
/// Throws LogicError for no frame, frames of differing size or other channels, or options out of
/// range; EnvironmentError if the encoder is missing or the file cannot be written.
void write_video(const std::filesystem::path& path, Index count,
                 const std::function<Image(Index frame_idx)>& frame,
                 const VideoOptions& options = {});

}  // namespace atelier
