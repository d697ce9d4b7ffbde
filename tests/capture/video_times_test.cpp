// When the images of MP4 files are shown: of tables that are written here, and of files by ffmpeg,
// whose images say by their grey which they are.

#include "capture/video_times.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "capture/layouts/open_dataset.h"
#include "capture/video_file.h"
#include "core/error.h"
#include "tests/capture/mp4_tables.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::Mp4Tables;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

std::optional<VideoTimes> times_of(const std::string& file, const Limits& limits = {}) {
  return read_video_times(std::as_bytes(std::span(file)), "a.mp4", limits);
}

VideoTimes times_of(const Mp4Tables& tables) {
  return times_of(fixtures::mp4_tables(tables)).value();
}

TEST(VideoTimes, EvenVideo_HasItsRate) {
  const VideoTimes times = times_of(Mp4Tables{});
  EXPECT_THAT(times.ticks, SizeIs(10));
  EXPECT_EQ(times.hidden, 0);
  const VideoPace pace = video_pace(times);
  EXPECT_EQ(pace.fps, 25);
  EXPECT_EQ(pace.start, 0);
  EXPECT_EQ(pace.missing, 0);
  EXPECT_TRUE(video_findings(times, "a").empty());
  Mp4Tables ntsc;
  ntsc.ticks = 30'000;
  ntsc.steps = {{10, 1001}};
  EXPECT_EQ(video_pace(times_of(ntsc)).fps, 30'000 / 1001.0);
}

TEST(VideoTimes, CompositionOffsets_OrderImagesAsTheyAreShown) {
  Mp4Tables tables;
  tables.images = 4;
  tables.steps = {{4, 100}};
  tables.offsets = {{1, 100}, {1, 300}, {2, 0}};  // decoded I P B B, shown I B B P
  EXPECT_THAT(times_of(tables).ticks, ElementsAre(100, 200, 300, 400));
  tables.offsets = {{1, 0}, {1, 200}, {2, -100}};  // the same from 0, as version 1 writes it
  EXPECT_THAT(times_of(tables).ticks, ElementsAre(0, 100, 200, 300));
}

TEST(VideoTimes, EditList_HidesWhatIsBeforeAndBehindIt) {
  Mp4Tables tables;
  tables.edits = {{.duration = 120, .first = 4 * 512}};  // 3 of 10 images
  const VideoTimes times = times_of(tables);
  EXPECT_THAT(times.ticks, ElementsAre(0, 512, 1024));
  EXPECT_EQ(times.hidden, 7);
  tables.edits[0].duration = 0;  // to the end
  EXPECT_THAT(times_of(tables).ticks, SizeIs(6));
  tables.edits[0].first += 100;  // between two images
  EXPECT_EQ(times_of(tables).ticks.front(), 412);
}

TEST(VideoTimes, EmptyEdit_IsALateStart) {
  Mp4Tables tables;
  tables.edits = {
      {.duration = 150, .first = -1}, {.duration = 50, .first = -1}, {.duration = 400, .first = 0}};
  const VideoTimes times = times_of(tables);
  EXPECT_THAT(times.ticks, SizeIs(10));
  EXPECT_DOUBLE_EQ(video_pace(times).start, 0.2);
}

TEST(VideoTimes, SoundBeforeTheVideo_IsPassedOver) {
  Mp4Tables tables;
  tables.sound_first = true;
  EXPECT_THAT(times_of(tables).ticks, SizeIs(10));
}

TEST(VideoTimes, WhatCannotBeNumbered_IsRefusedWithTheCommandThatMendsIt) {
  Mp4Tables tables;
  tables.edits = {{.duration = 100, .first = 0}, {.duration = 100, .first = 2560}};
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "several parts of the recording");
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "ffmpeg -ignore_editlist 1 -i IN");
  tables.edits = {{.duration = 100, .first = 0, .speed = 0x2000}};
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "a speed of 0.125");
  tables.edits = {{.duration = 100, .first = -1}};
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "no part of the recording");
  tables.edits = {{.duration = 10, .first = 512'000}};
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "no image that is shown");
  tables = {.fragments = true};
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "images in fragments");
  ATELIER_EXPECT_REFUSED(times_of(tables), DataError, "ffmpeg -i IN -map 0:v:0 -c copy OUT.mp4");
  ATELIER_EXPECT_REFUSED(times_of(fixtures::mp4_tables({}), Limits{.frames = 9}), DataError,
                         "no number of frames that is possible: 10");
}

TEST(VideoTimes, OtherFiles_SayNothing) {
  EXPECT_FALSE(times_of(std::string()).has_value());
  EXPECT_FALSE(times_of(std::string("RIFF\x10\0\0\0AVI LIST", 16)).has_value());
  EXPECT_FALSE(times_of(fixtures::mp4_box("ftyp", "isom")).has_value());
  EXPECT_FALSE(times_of(fixtures::mp4_box("moov", "")).has_value());
}

TEST(VideoPaces, MissingImages_AreCountedAndTheRateIsThatOfTheOthers) {
  Mp4Tables tables;
  tables.steps = {{3, 512}, {1, 1536}, {6, 512}};  // two are missing before the fifth
  const VideoTimes times = times_of(tables);
  const VideoPace pace = video_pace(times);
  EXPECT_EQ(pace.fps, 25);
  EXPECT_EQ(pace.missing, 2);
  EXPECT_EQ(pace.first_gap, 4);
  EXPECT_EQ(pace.uneven, -1);
  const std::vector<Finding> findings = video_findings(times, "cam1");
  ASSERT_THAT(findings, SizeIs(1));
  EXPECT_EQ(findings[0].code, "video-frames-missing");
  EXPECT_THAT(findings[0].what, HasSubstr("image 4 comes 0.12 s after the one before it"));
  EXPECT_THAT(findings[0].advice, HasSubstr("-fps_mode cfr -r 25 "));
}

TEST(VideoPaces, UnevenImages_AreReported) {
  Mp4Tables tables;
  tables.steps = {{4, 512}, {1, 800}, {5, 512}};
  const VideoTimes times = times_of(tables);
  EXPECT_EQ(video_pace(times).uneven, 5);
  EXPECT_EQ(video_findings(times, "cam1").at(0).code, "video-uneven");
  tables.steps = {{3, 512}, {1, 550}, {1, 474}, {5, 512}};  // a clock that shakes a little
  EXPECT_TRUE(video_findings(times_of(tables), "cam1").empty());
}

TEST(VideoPaces, OneImage_HasNoRate) {
  Mp4Tables tables;
  tables.images = 1;
  tables.steps = {{1, 512}};
  EXPECT_EQ(video_pace(times_of(tables)).fps, 0);
}

/// Videos by ffmpeg of 40 images at 25 Hz: image k has the grey 20 + 5 k, with a key image every
/// twelve and B-frames between.
class VideosByFfmpeg : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) {
      GTEST_SKIP() << "no ffmpeg";
    }
    std::ofstream raw(folder / "raw", std::ios::binary);
    for (int k = 0; k < 40; ++k) {
      raw << std::string(64 * 64, static_cast<char>(20 + 5 * k)) << std::string(64 * 32, '\x80');
    }
    raw.close();
    ffmpeg(
        "-f rawvideo -pix_fmt yuv420p -s 64x64 -r 25 -i raw -c:v libx264 -qp 4 -bf 3 -x264-params "
        "keyint=12:min-keyint=12:scenecut=0:b-adapt=0 whole.mp4");
  }

  void ffmpeg(const std::string& arguments) const {
    const std::string command =
        "cd '" + folder.path().string() + "' && ffmpeg -v error -nostdin -y " + arguments;
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }

  /// Which of the 40 a decoded image is, by its grey of BT.601's range.
  static int number(const ByteImage& image) {
    return static_cast<int>(std::lround((image.at(32, 32, 1) * 219 / 255.0 + 16 - 20) / 5));
  }

  /// Every image of a video, in its order.
  std::vector<int> numbers(const char* name) const {
    VideoFile video(folder / name);
    std::vector<int> all;
    for (int i = 0; i < video.frames(); ++i) {
      all.push_back(number(video.frame(i)));
    }
    return all;
  }

  static std::vector<int> range(int first, int last) {
    std::vector<int> all;
    for (int k = first; k <= last; ++k) {
      all.push_back(k);
    }
    return all;
  }

  fixtures::TemporaryDirectory folder;
};

TEST_F(VideosByFfmpeg, BFrames_KeepTheirOrder) {
  EXPECT_EQ(numbers("whole.mp4"), range(0, 39));
  ffmpeg("-i whole.mp4 -c copy -movflags negative_cts_offsets negative.mp4");
  EXPECT_EQ(numbers("negative.mp4"), range(0, 39));
  ffmpeg("-i whole.mp4 -c copy -use_editlist 0 plain.mp4");
  EXPECT_EQ(numbers("plain.mp4"), range(0, 39));
  ffmpeg("-i whole.mp4 -c copy whole.mov");
  EXPECT_EQ(numbers("whole.mov"), range(0, 39));
}

// CAP_PROP_FRAME_COUNT says 40 of what is stored (findings/opencv_edit_list_count.sh).
TEST_F(VideosByFfmpeg, TrimmedVideo_HasTheImagesThatAreShown) {
  ffmpeg("-ss 0.4 -i whole.mp4 -c copy trimmed.mp4");
  EXPECT_EQ(numbers("trimmed.mp4"), range(10, 39));
  VideoFile trimmed(folder / "trimmed.mp4");
  EXPECT_EQ(trimmed.fps(), 25);
  EXPECT_EQ(number(trimmed.frame(29)), 39);
  EXPECT_EQ(number(trimmed.frame(3)), 13) << "backward";
  EXPECT_EQ(trimmed.times()->ticks.front(), 0);
  // Cut behind as well, in the order of decoding: image 31 is gone, and the times tell.
  ffmpeg("-ss 0.6 -i whole.mp4 -t 0.6 -c copy both.mp4");
  const std::vector<int> both = numbers("both.mp4");
  const VideoTimes times = VideoFile(folder / "both.mp4").times().value();
  ASSERT_EQ(both.size(), times.ticks.size());
  EXPECT_GE(both.size(), 15U);
  for (std::size_t i = 0; i < both.size(); ++i) {
    EXPECT_EQ(both[i], 15 + 25 * times.ticks[i] / times.ticks_per_second) << i;
  }
}

TEST_F(VideosByFfmpeg, LateStart_IsSaidWithTheOffsetThatKeepsIt) {
  fs::create_directories(folder / "capture/videos");
  ffmpeg("-i whole.mp4 -c copy capture/videos/a.mp4");
  ffmpeg("-itsoffset 0.2 -i whole.mp4 -c copy capture/videos/b.mp4");
  EXPECT_DOUBLE_EQ(video_pace(*VideoFile(folder / "capture/videos/b.mp4").times()).start, 0.2);
  Dataset dataset = open_dataset(folder / "capture");
  const auto said = [&] {
    std::vector<Finding> some;
    for (const Finding& finding : dataset.findings) {
      if (finding.code.starts_with("video-")) {
        some.push_back(finding);
      }
    }
    return some;
  };
  ASSERT_THAT(said(), SizeIs(1));
  EXPECT_EQ(said()[0].code, "video-start");
  EXPECT_EQ(said()[0].place, "b");
  EXPECT_THAT(said()[0].what, HasSubstr("0.2 s later than that of a"));
  EXPECT_THAT(said()[0].advice, HasSubstr("--capture.sync b=5 "));
  DatasetOptions options;
  options.corrections.sync = "b=5";
  dataset = open_dataset(folder / "capture", options);
  EXPECT_TRUE(said().empty());
  FrameReader reader(dataset);
  EXPECT_EQ(number(*reader.byte_image(0, 12)), 12);
  EXPECT_EQ(number(*reader.byte_image(1, 12)), 7) << "0.48 s after both files began";
}

TEST_F(VideosByFfmpeg, VariableRate_IsReadWholeAndSaid) {
  // Every third image is left out, and the rest keep their times.
  ffmpeg("-i whole.mp4 -vf \"select='mod(n,3)'\" -fps_mode vfr -c:v libx264 -qp 4 gaps.mp4");
  VideoFile gaps(folder / "gaps.mp4");
  ASSERT_EQ(gaps.frames(), 26);
  EXPECT_EQ(number(gaps.frame(25)), 38);
  ffmpeg(
      "-i whole.mp4 -vf \"select='1-eq(n,7)-eq(n,8)'\" -fps_mode vfr -c:v libx264 -qp 4 two.mp4");
  VideoFile two(folder / "two.mp4");
  ASSERT_EQ(two.frames(), 38);
  EXPECT_EQ(number(two.frame(7)), 9);
  const VideoPace pace = video_pace(*two.times());
  EXPECT_EQ(pace.missing, 2);
  EXPECT_EQ(pace.first_gap, 7);
  EXPECT_DOUBLE_EQ(two.fps(), 25);
  // The command that the finding gives puts every image at its time: neighbours fill the gap.
  EXPECT_EQ(video_findings(*two.times(), "two").at(0).code, "video-frames-missing");
  ffmpeg("-i two.mp4 -fps_mode cfr -r 25 -c:v libx264 -crf 12 mended.mp4");
  std::vector<int> mended = numbers("mended.mp4");
  ASSERT_EQ(mended.size(), 40U);
  mended[7] = 7;
  mended[8] = 8;
  EXPECT_EQ(mended, range(0, 39));
}

TEST_F(VideosByFfmpeg, FragmentedVideo_IsRefusedAndTheCommandMendsIt) {
  ffmpeg("-i whole.mp4 -c copy -movflags frag_keyframe+empty_moov fragments.mp4");
  ATELIER_EXPECT_REFUSED(VideoFile(folder / "fragments.mp4"), DataError, "images in fragments");
  ffmpeg("-i fragments.mp4 -map 0:v:0 -c copy mended.mp4");
  EXPECT_EQ(numbers("mended.mp4"), range(0, 39));
}

TEST_F(VideosByFfmpeg, Matroska_IsReadAsItsContainerCounts) {
  ffmpeg("-i whole.mp4 -c copy whole.mkv");
  EXPECT_EQ(numbers("whole.mkv"), range(0, 39));
  EXPECT_FALSE(VideoFile(folder / "whole.mkv").times().has_value());
}

}  // namespace
}  // namespace atelier
