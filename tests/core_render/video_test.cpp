#include "core/render/video.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <opencv2/videoio.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "core/error.h"
#include "tests/core_render/shapes.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A white square that moves right over coloured ground.
Image moving(Index i, int width = 64, int height = 48) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool inside = y >= 16 && y < 32 && x >= 4 * i && x < 4 * i + 16;
      image.at(x, y, 0) = inside ? 1.0f : 0.5f;
      image.at(x, y, 1) = inside ? 1.0f : 0.1f;
      image.at(x, y, 2) = inside ? 1.0f : 0.1f;
    }
  }
  return image;
}

std::vector<cv::Mat> read_back(const std::filesystem::path& path) {
  cv::VideoCapture capture(path.string(), cv::CAP_FFMPEG);
  std::vector<cv::Mat> frames;
  cv::Mat frame;
  while (capture.read(frame)) {
    frames.push_back(frame.clone());
  }
  return frames;
}

TEST(Video, WrittenVideo_PlaysBackFrameByFrame) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  write_video(path, 10, [](Index i) { return moving(i); }, {.fps = 12, .quality = 12});
  const auto frames = read_back(path);
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_EQ(frames[0].cols, 64);
  EXPECT_EQ(frames[0].rows, 48);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int x = static_cast<int>(4 * i) + 8;
    EXPECT_GT(frames[i].at<cv::Vec3b>(24, std::min(x, 60))[0], 225) << i;
  }
  cv::VideoCapture capture(path.string(), cv::CAP_FFMPEG);
  EXPECT_NEAR(capture.get(cv::CAP_PROP_FPS), 12, 1e-3);
}

TEST(Video, VideoIndex_PrecedesTheData) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  write_video(path, 3, [](Index i) { return moving(i); });
  const std::string bytes = bytes_of(path);
  EXPECT_NE(bytes.find("ftyp"), std::string::npos);
  EXPECT_NE(bytes.find("avc1"), std::string::npos);
  EXPECT_LT(bytes.find("moov"), bytes.find("mdat"));
}

TEST(Video, LastBox_IsInTheFileBeforeItHasItsName) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  const std::string box(
      "\0\0\0\x0C"
      "free"
      "last",
      12);
  VideoWriter video(path);
  video.add(srgb_from_linear(moving(0)));
  std::string rest;
  video.finish([&](const std::filesystem::path& film) {
    EXPECT_FALSE(std::filesystem::exists(path));
    rest = bytes_of(film);
    return box;
  });
  EXPECT_EQ(bytes_of(path), rest + box);
  EXPECT_EQ(read_back(path).size(), 1u);
}

TEST(Video, LastBoxThatFails_LeavesNoVideo) {
  const fixtures::TemporaryDirectory folder;
  {
    VideoWriter video(folder / "a.mp4");
    video.add(moving(0));
    EXPECT_THROW(video.finish([](const std::filesystem::path&) -> std::string {
      throw DataError("", "film", "too large", "a smaller one");
    }),
                 DataError);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Video, OddSizes_BecomeEven) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  write_video(path, 2, [](Index i) { return moving(i, 63, 47); });
  const auto frames = read_back(path);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].cols, 64);
  EXPECT_EQ(frames[0].rows, 48);
}

TEST(Video, OneFrameOfOnePixel_IsEnough) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  write_video(path, 1, [](Index) { return Image(1, 1, 3, 0.5f); });
  EXPECT_EQ(read_back(path).size(), 1u);
}

TEST(Video, SameFrames_GiveIdenticalBytes) {
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"a.mp4", "b.mp4"}) {
    write_video(folder / name, 5, [](Index i) { return moving(i); });
  }
  EXPECT_TRUE(bytes_of(folder / "a.mp4") == bytes_of(folder / "b.mp4"));
}

TEST(Video, Ffprobe_SeesWhatBrowsersNeed) {
  if (std::system("ffprobe -version >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no ffprobe";
  }
  const fixtures::TemporaryDirectory folder;
  write_video(folder / "a.mp4", 4, [](Index i) { return moving(i); }, {.fps = 29.97});
  const std::string command = "ffprobe -v error -count_frames -show_streams " +
                              (folder / "a.mp4").string() + " > " + (folder / "probe").string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string probe = bytes_of(folder / "probe");
  for (const char* line : {"codec_name=h264", "pix_fmt=yuv420p", "nb_read_frames=4",
                           "color_space=bt709", "color_range=tv"}) {
    EXPECT_THAT(probe, HasSubstr(line));
  }
}

TEST(Video, WrittenVideo_DecodesInChromium) {
  const fixtures::TemporaryDirectory folder;
  if (fixtures::run_child({"sh", "-c", "command -v chromium"}).exit_code != 0) {
    GTEST_SKIP() << "no program chromium (scripts/setup)";
  }
  write_video(folder / "a.mp4", 10, [](Index i) { return moving(i); }, {.fps = 5});
  // A page is loaded once its videos have their first image (readyState 2 or more).
  std::ofstream(folder / "page.html")
      << "<video id=v muted preload=auto src=a.mp4></video><script>onload = () => {"
         "document.body.textContent = `ready ${v.readyState >= 2} size ${v.videoWidth}x"
         "${v.videoHeight} seconds ${v.duration.toFixed(2)} error ${v.error}`}</script>";
  const fixtures::ChildResult result =
      fixtures::run_child({"chromium", "--headless", "--no-sandbox", "--disable-gpu",
                           "--user-data-dir=" + (folder / "profile").string(), "--dump-dom",
                           "file://" + (folder / "page.html").string()});
  EXPECT_THAT(result.out, HasSubstr("ready true size 64x48 seconds 2.00 error null")) << result.err;
}

TEST(Video, Colors_RoundTrip) {
  if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no ffmpeg (OpenCV's reader takes every video for BT.601)";
  }
  const fixtures::TemporaryDirectory folder;
  write_video(folder / "a.mp4", 1, [](Index i) { return moving(i); }, {.quality = 5});
  const std::string command = "ffmpeg -v error -i " + (folder / "a.mp4").string() +
                              " -pix_fmt rgb24 -f rawvideo " + (folder / "rgb").string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string rgb = bytes_of(folder / "rgb");
  ASSERT_EQ(rgb.size(), 64u * 48 * 3);
  const auto byte = [&](int x, int y, int c) {
    return static_cast<int>(
        static_cast<unsigned char>(rgb[static_cast<std::size_t>((y * 64 + x) * 3 + c)]));
  };
  EXPECT_NEAR(byte(40, 6, 0), 188, 4);  // linear 0.5
  EXPECT_NEAR(byte(40, 6, 1), 89, 4);   // linear 0.1
  EXPECT_NEAR(byte(40, 6, 2), 89, 4);
  EXPECT_NEAR(byte(8, 24, 0), 255, 4);
  EXPECT_NEAR(byte(8, 24, 2), 255, 4);
}

TEST(Video, FrameByFrameWriting_GivesIdenticalBytes) {
  const fixtures::TemporaryDirectory folder;
  write_video(folder / "whole.mp4", 5, [](Index i) { return moving(i); }, {.fps = 12});
  VideoWriter video(folder / "grown.mp4", {.fps = 12});
  for (Index i = 0; i < 5; ++i) {
    EXPECT_EQ(video.frames(), i);
    video.add(moving(i));
    EXPECT_FALSE(std::filesystem::exists(folder / "grown.mp4")) << "whole or not at all";
  }
  video.finish();
  EXPECT_THROW(video.add(moving(5)), LogicError);
  EXPECT_TRUE(bytes_of(folder / "grown.mp4") == bytes_of(folder / "whole.mp4"));
}

TEST(VideoRefusal, UnfinishedVideo_LeavesNothingBehind) {
  const fixtures::TemporaryDirectory folder;
  {
    VideoWriter video(folder / "a.mp4");
    EXPECT_THROW(video.finish(), LogicError) << "no frame";
    video.add(moving(0));
    EXPECT_THROW(video.add(moving(1, 32)), LogicError) << "of another size";
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(VideoRefusal, NoFramesOrBadFrames_Throw) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  EXPECT_THROW(write_video(path, 0, [](Index i) { return moving(i); }), LogicError);
  EXPECT_THROW(write_video(path, 1, [](Index) { return Image(4, 4, 1); }), LogicError);
  EXPECT_THROW(write_video(path, 1, [](Index) { return Image(); }), LogicError);
  EXPECT_THROW(
      write_video(path, 2, [](Index i) { return moving(i, 32 + 2 * static_cast<int>(i)); }),
      LogicError);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "nothing is left behind";
}

TEST(VideoRefusal, OptionOutOfRange_Throws) {
  const fixtures::TemporaryDirectory folder;
  const auto frame = [](Index i) { return moving(i); };
  EXPECT_THROW(write_video(folder / "a.mp4", 1, frame, {.fps = 0}), LogicError);
  EXPECT_THROW(write_video(folder / "a.mp4", 1, frame, {.fps = 1e9}), LogicError);
  EXPECT_THROW(write_video(folder / "a.mp4", 1, frame, {.quality = 52}), LogicError);
  EXPECT_THROW(write_video(folder / "a.mp4", 1, frame, {.quality = -1}), LogicError);
}

TEST(VideoRefusal, MissingFolder_Throws) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(write_video(folder / "none/a.mp4", 1, [](Index i) { return moving(i); }),
               EnvironmentError);
}

// While it lives, no file of this process may grow beyond `bytes`: writes fail as on a full disk.
class SmallFiles {
 public:
  explicit SmallFiles(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~SmallFiles() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SmallFiles(const SmallFiles&) = delete;
  SmallFiles& operator=(const SmallFiles&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(VideoRefusal, FullDisk_KeepsOldFile) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  write_video(path, 2, [](Index i) { return moving(i); });
  const std::string before = bytes_of(path);
  for (const rlim_t bytes : {rlim_t{0}, rlim_t{100}, rlim_t{1500}}) {
    const SmallFiles limit(bytes);
    try {
      write_video(path, 20, [](Index i) { return moving(i, 256, 192); }, {.quality = 5});
      FAIL() << "written within " << bytes << " bytes";
    } catch (const EnvironmentError& error) {
      EXPECT_THAT(error.what(), HasSubstr("a.mp4"));
    }
  }
  EXPECT_TRUE(bytes_of(path) == before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(VideoRefusal, ThrowingFrame_KeepsOldFile) {
  const fixtures::TemporaryDirectory folder;
  const auto path = folder / "a.mp4";
  write_video(path, 2, [](Index i) { return moving(i); });
  const std::string before = bytes_of(path);
  EXPECT_THROW(write_video(path, 3,
                           [](Index i) {
                             if (i == 2) {
                               throw DataError("frame", "2", "nothing", "an image");
                             }
                             return moving(i);
                           }),
               DataError);
  EXPECT_TRUE(bytes_of(path) == before);
}

}  // namespace
}  // namespace atelier
