#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "capture/video_times.h"
#include "core/image.h"
#include "core/limits.h"

namespace atelier {

/// A video (MP4 and MOV, AVI, Matroska), decoded frame by frame through OpenCV and FFmpeg.
///
/// Of an MP4 or MOV the frames are those that are shown (video_times.h): a trimmed one begins at
/// its first, and a late start does not move them. Of the others their container says how many
/// there are.
///
/// Only files that begin as those containers do are opened: FFmpeg also reads play lists that name
/// other files and addresses. Throws DataError for another file, no or more frames than
/// `limits.frames`, images beyond `limits`, a frame that cannot be decoded, and as
/// read_video_times. Turned videos (a
/// phone's) come as a player shows them.
class VideoFile {
 public:
  explicit VideoFile(const std::filesystem::path& path, const Limits& limits = {});
  ~VideoFile();
  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;

  int width() const;   ///< pixels
  int height() const;  ///< pixels
  int frames() const;
  double fps() const;  ///< frames per second; 0 if the container does not say

  /// When they are shown, in seconds of the file's own clock; nothing where the container does not
  /// say it of each.
  const std::optional<VideoTimes>& times() const;

  /// Frame from 0, sRGB, 3 channels. Forward it decodes what lies between; backward it starts again
  /// from the beginning, so that the frame is exact in every codec.
  ByteImage frame(int index);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace atelier
