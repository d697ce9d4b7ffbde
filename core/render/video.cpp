#include "core/render/video.h"

#include <cerrno>
#include <fstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/late_library.h"
#include "core/render/late/film.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

/// @param name  for errors
void append(const std::filesystem::path& file, const std::string& bytes,
            const std::filesystem::path& name) {
  std::ofstream out(file, std::ios::binary | std::ios::app);
  out << bytes;
  out.close();
  if (!out) {
    throw EnvironmentError(name.string(), "cannot write: " + system_reason(errno));
  }
}

}  // namespace

VideoWriter::VideoWriter(std::filesystem::path path, const VideoOptions& options)
    : path_(std::move(path)), options_(options) {
  ATELIER_CHECK(options.fps >= 0.1 && options.fps <= 1000, "fps must lie in [0.1, 1000]");
  ATELIER_CHECK(options.quality >= 0 && options.quality <= 51, "quality must lie in [0, 51]");
}

VideoWriter::~VideoWriter() = default;

void VideoWriter::add(const Image& frame) {
  add(srgb_from_linear(frame));
}

void VideoWriter::add(const ByteImage& frame) {
  if (!video_) {
    ATELIER_CHECK(!file_, "a video that is finished takes no more frames");
    ATELIER_CHECK(frame.channels == 3 && frame.width > 0 && frame.height > 0,
                  "a video needs frames of 3 channels");
    width_ = frame.width;
    height_ = frame.height;
    static const auto new_video =
        late_function<decltype(atelier_new_film)>("libatelier_film.so", "atelier_new_film");
    file_ = std::make_unique<AtomicFile>(path_);
    video_.reset(new_video(path_, file_->temporary_path(), (width_ + 1) / 2 * 2,
                           (height_ + 1) / 2 * 2, options_));
  }
  ATELIER_CHECK(frame.width == width_ && frame.height == height_ && frame.channels == 3,
                "a video needs frames of one size");
  video_->add(frame, frames_);
  ++frames_;
}

void VideoWriter::finish(
    const std::function<std::string(const std::filesystem::path& film)>& last_box) {
  ATELIER_CHECK(video_ != nullptr, "a video needs at least one frame");
  video_->finish();
  video_.reset();
  if (last_box) {
    append(file_->temporary_path(), last_box(file_->temporary_path()), path_);
  }
  file_->commit();
}

void write_video(const std::filesystem::path& path, Index count,
                 const std::function<Image(Index frame_idx)>& frame, const VideoOptions& options) {
  VideoWriter video(path, options);
  for (Index i = 0; i < count; ++i) {
    video.add(frame(i));
  }
  video.finish();
}

}  // namespace atelier
