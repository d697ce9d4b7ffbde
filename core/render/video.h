#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/image.h"
#include "core/options.h"
#include "core/types.h"

namespace atelier {

class AtomicFile;
struct VideoEncoder;  ///< private to core/render

struct VideoOptions {
  double fps = 30;   ///< frames per second, [0.1, 1000]
  int quality = 20;  ///< x264's constant rate factor, [0, 51]; 20 is hard to tell from the source,
                     ///< 28 is small
};

OptionTable describe(VideoOptions& options);

/// H.264 in MP4 (yuv420p, BT.709, index in front) that browsers play, frame after frame: none is
/// kept. The file appears whole with `finish` or not at all (core/atomic_file.h). One encoder
/// thread: the same frames give the same bytes.
/// Everything throws LogicError for no frame, frames of differing size or other channels, or
/// options out of range; EnvironmentError if the encoder is missing or the file cannot be written.
class VideoWriter {
 public:
  explicit VideoWriter(std::filesystem::path path, const VideoOptions& options = {});
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Linear RGB [height, width, 3] in [0,1]; an odd last row or column is repeated once.
  void add(const Image& frame);
  /// The same of sRGB bytes.
  void add(const ByteImage& frame);
  /// Frames that were added.
  Index frames() const { return frames_; }
  /// @param last_box  gives what is appended to the file before it has its name: a box of MP4 on
  /// all others. It gets the place of the file till then; where it throws, there is no video
  void finish(const std::function<std::string(const std::filesystem::path& film)>& last_box = {});

 private:
  std::filesystem::path path_;
  VideoOptions options_;
  Index frames_ = 0;
  int width_ = 0;
  int height_ = 0;
  std::unique_ptr<AtomicFile> file_;
  std::unique_ptr<VideoEncoder> video_;
};

/// A video of `count` frames, of which `frame(i)` gives one (VideoWriter).
void write_video(const std::filesystem::path& path, Index count,
                 const std::function<Image(Index frame_idx)>& frame,
                 const VideoOptions& options = {});

}  // namespace atelier
