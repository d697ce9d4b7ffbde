#include "capture/video_file.h"

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include <unistd.h>

#include "core/error.h"
#include "core/late_library.h"
#include "core/regular_file.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// DataError unless the first bytes are those of a container that holds its images itself.
void check_container(const std::filesystem::path& path) {
  const RegularFile file(path);
  std::array<char, 12> head{};
  const ssize_t got = pread(file.descriptor(), head.data(), head.size(), 0);
  const auto at = [&](std::size_t offset, const char* word) {
    return got == static_cast<ssize_t>(head.size()) &&
           std::memcmp(head.data() + offset, word, std::strlen(word)) == 0;
  };
  const bool known = at(4, "ftyp") || at(4, "moov") || at(4, "mdat") || at(4, "wide") ||
                     at(4, "free") || (at(0, "RIFF") && at(8, "AVI ")) || at(0, "\x1a\x45\xdf\xa3");
  if (!known) {
    throw DataError(path.string(), "first bytes", "no video that is read",
                    "MP4, MOV, AVI or Matroska");
  }
}

/// Of capture/late/videos.cpp.
std::unique_ptr<cv::VideoCapture> new_video() {
  static const auto make =
      late_function<cv::VideoCapture*()>("libatelier_videos.so", "atelier_new_video");
  return std::unique_ptr<cv::VideoCapture>(make());
}

}  // namespace

struct VideoFile::State {
  std::filesystem::path path;
  std::unique_ptr<cv::VideoCapture> video = new_video();
  int width = 0;
  int height = 0;
  int frames = 0;
  double fps = 0;
  std::optional<VideoTimes> times;
  int next = 0;  ///< frame that a read would give

  void open() {
    try {
      if (!video->open(std::filesystem::absolute(path).string(), cv::CAP_FFMPEG)) {
        throw DataError(path.string(), "", "a video that FFmpeg cannot open", "an undamaged one");
      }
    } catch (const cv::Exception& error) {
      throw DataError(path.string(), "", "a video that cannot be opened: " + error.err,
                      "an undamaged one");
    }
    next = 0;
  }
};

VideoFile::VideoFile(const std::filesystem::path& path, const Limits& limits)
    : state_(std::make_unique<State>()) {
  check_container(path);
  state_->path = path;
  state_->open();
  const auto property = [&](int which) { return state_->video->get(which); };
  const double width = property(cv::CAP_PROP_FRAME_WIDTH);
  const double height = property(cv::CAP_PROP_FRAME_HEIGHT);
  state_->times = read_video_times(path, limits);
  // FFmpeg counts what is stored, an edit list's hidden images too.
  const double frames = state_->times ? static_cast<double>(state_->times->ticks.size())
                                      : property(cv::CAP_PROP_FRAME_COUNT);
  if (!(width >= 1 && height >= 1 && width <= static_cast<double>(limits.image_side) &&
        height <= static_cast<double>(limits.image_side) &&
        width * height <= static_cast<double>(limits.image_pixels))) {
    throw DataError(path.string(), "", "images of no size or beyond the limits",
                    "1 to " + std::to_string(limits.image_side) + " pixels a side");
  }
  if (!(frames >= 1 && frames <= static_cast<double>(limits.frames))) {
    throw DataError(path.string(), "", "no number of frames that is possible",
                    "1 to " + std::to_string(limits.frames));
  }
  state_->width = saturating_cast<int>(width);
  state_->height = saturating_cast<int>(height);
  state_->frames = saturating_cast<int>(frames);
  const double fps = state_->times && state_->times->ticks.size() > 1
                         ? video_pace(*state_->times).fps
                         : property(cv::CAP_PROP_FPS);
  constexpr double kMaxFps = 10'000;
  state_->fps = fps > 0 && fps <= kMaxFps ? fps : 0;
}

VideoFile::~VideoFile() = default;
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;

int VideoFile::width() const {
  return state_->width;
}
int VideoFile::height() const {
  return state_->height;
}
int VideoFile::frames() const {
  return state_->frames;
}
double VideoFile::fps() const {
  return state_->fps;
}
const std::optional<VideoTimes>& VideoFile::times() const {
  return state_->times;
}

ByteImage VideoFile::frame(int index) {
  ATELIER_CHECK(index >= 0 && index < state_->frames, "a frame that the video does not have");
  const auto fail = [&](const std::string& found) {
    throw DataError(state_->path.string(), "frame " + std::to_string(index), found,
                    "an image; the file says " + std::to_string(state_->frames) + " frames: " +
                        (state_->times ? "it is cut off"
                                       : "it is cut off, or says it wrongly: ffmpeg -i IN -map "
                                         "0:v:0 -c copy OUT.mp4 counts them"));
  };
  if (index < state_->next) {
    state_->open();
  }
  cv::Mat picture;
  try {
    for (; state_->next < index; ++state_->next) {
      if (!state_->video->grab()) {
        fail("the end of the video at frame " + std::to_string(state_->next));
      }
    }
    if (!state_->video->read(picture) || picture.empty()) {
      fail("nothing that can be decoded");
    }
  } catch (const cv::Exception& error) {
    fail("a decoder's error: " + error.err);
  }
  ++state_->next;
  if (picture.type() != CV_8UC3 || picture.cols != state_->width ||
      picture.rows != state_->height) {
    fail("an image of another size or kind");
  }
  ByteImage image(picture.cols, picture.rows, 3);
  cv::Mat target(picture.rows, picture.cols, CV_8UC3, image.data.data());
  cv::cvtColor(picture, target, cv::COLOR_BGR2RGB);
  return image;
}

}  // namespace atelier
