// Numbers of frames in the names of files as cameras and programs write them.

#include <algorithm>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/frame_number.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/posed_images.h"
#include "capture/layouts/write_layout.h"
#include "capture/time_stamp.h"
#include "core/io/file_bytes.h"
#include "tests/capture/finding_of.h"
#include "tests/capture/small_capture.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::finding_of;

TEST(FrameNames, CameraNumberLast_IsNotTheFrames) {
  EXPECT_EQ(frame_run({"000001_cam04.png", "000002_cam04.png"}), 1U);
  EXPECT_EQ(frame_run({"frame12-view_3.png"}), 1U);
  EXPECT_EQ(frame_run({"000001_04.png", "000002_04.png"}), 1U);
  EXPECT_EQ(frame_run({"Cam001_rgb000003.jpg", "Cam001_rgb000004.jpg"}), 0U);
  EXPECT_EQ(frame_run({"000012.png"}), 0U);
  EXPECT_EQ(frame_number("000012_cam04.png", 1), 12);
  fixtures::TemporaryDirectory folder;
  fs::create_directories(folder / "cam04");
  for (const char* name : {"000007_04.png", "000009_04.png"}) {
    write_image(folder / "cam04" / name, ByteImage(4, 4, 1));
  }
  const auto files = numbered_files(folder / "cam04");
  ASSERT_EQ(files.size(), 2U);
  EXPECT_TRUE(files.contains(7));
  EXPECT_TRUE(files.contains(9));
}

TEST(FrameNames, CounterThatBeginsAgain_IsCountedOn) {
  const auto numbers_of = [](const std::vector<std::string>& names) {
    const fixtures::TemporaryDirectory folder;
    for (const std::string& name : names) {
      write_image(folder / name, ByteImage(4, 4, 1));
    }
    std::vector<int> numbers;
    for (const auto& [number, place] : numbered_files(folder.path())) {
      numbers.push_back(number);
    }
    return numbers;
  };
  using Numbers = std::vector<int>;
  // Cameras of three makers: four digits, five of which the first stays 0, from 0 or from 1. The
  // frame behind 9999 is the next one, whatever the counter begins with.
  EXPECT_EQ(numbers_of({"IMG_9998.png", "IMG_9999.png", "IMG_0001.png", "IMG_0002.png"}),
            (Numbers{9998, 9999, 10000, 10001}));
  EXPECT_EQ(numbers_of({"DSC09998.png", "DSC09999.png", "DSC00000.png", "DSC00001.png"}),
            (Numbers{9998, 9999, 10000, 10001}));
  EXPECT_EQ(numbers_of({"f99998.png", "f99999.png", "f00000.png", "f00001.png"}),
            (Numbers{99998, 99999, 100000, 100001}));
  // No counter that begins again: a part of the middle is there, or the end is not.
  EXPECT_EQ(numbers_of({"a0000.png", "a0001.png", "a5000.png", "a9998.png", "a9999.png"}),
            (Numbers{0, 1, 5000, 9998, 9999}));
  EXPECT_EQ(numbers_of({"a0000.png", "a0001.png", "a9997.png", "a9998.png"}),
            (Numbers{0, 1, 9997, 9998}));
  EXPECT_EQ(numbers_of({"a000.png", "a001.png", "a998.png", "a999.png"}),
            (Numbers{0, 1, 998, 999}));
}

TEST(FrameNames, CounterOfPosedImagesThatBeginsAgain_IsCountedOn) {
  std::vector<PosedImage> images;
  const auto add = [&](const std::string& name, double place) {
    PosedImage image;
    image.name = name;
    image.camera.width = image.camera.height = 8;
    image.camera.camera_from_world_translation.x() = place;
    images.push_back(image);
  };
  for (const char* number : {"9998", "9999", "0001", "0002"}) {
    add(std::string("left/IMG_") + number + ".jpg", 1);
  }
  for (const char* number : {"9998", "9999", "10000", "10001"}) {
    add(std::string("right/P") + number + ".jpg", 2);
  }
  const Dataset dataset = dataset_of(images, "transforms.json");
  ASSERT_EQ(dataset.cameras.size(), 2U);
  EXPECT_EQ(dataset.frames[0].images.frames(), dataset.frames[1].images.frames());
  EXPECT_EQ(dataset.frames[0].images.frames(), (std::vector<int>{9998, 9999, 10000, 10001}));
}

TEST(FrameNames, CameraNumberLastInPosedImages_MakesCamerasNotFrames) {
  fixtures::TemporaryDirectory folder;
  fixtures::write_small_capture(folder / "capture");
  const fs::path written =
      write_layout(folder / "capture", "nerfstudio", folder / "nerf").folders.front();
  // "00_000003.png" becomes "f000003_cam00.png".
  std::string text = read_file_text(written / "transforms.json", 1 << 20);
  for (const char* camera : {"00", "01", "02"}) {
    for (const char* frame : {"000003", "000004", "000000", "000001"}) {
      const std::string before = std::string(camera) + "_" + frame + ".png";
      const std::string after = "f" + std::string(frame) + "_cam" + camera + ".png";
      for (const char* part : {"images", "masks"}) {
        if (fs::exists(written / part / before)) {
          fs::rename(written / part / before, written / part / after);
        }
      }
      for (std::size_t at = text.find(before); at != std::string::npos; at = text.find(before)) {
        text.replace(at, before.size(), after);
      }
    }
  }
  write_file_atomically(written / "transforms.json", text);
  const Dataset dataset = open_dataset(written);
  ASSERT_EQ(dataset.cameras.size(), 3U);
  EXPECT_EQ(dataset.frames[0].images.size(), 2U);
  EXPECT_EQ(finding_of(dataset.findings, "pictures-are-cameras"), nullptr);
}

TEST(FrameNames, TimeStamps_NumberFramesOverAllCameras) {
  fixtures::TemporaryDirectory folder;
  const std::int64_t start = 1'698'765'432'123'456;  // microseconds
  for (int c = 0; c < 2; ++c) {
    const fs::path camera = folder / "images" / ("cam" + std::to_string(c));
    fs::create_directories(camera);
    for (int f = 0; f < 5; ++f) {
      if (c == 1 && f == 2) {
        continue;  // dropped
      }
      write_image(camera / (std::to_string(start + 40'000 * f + 900 * c + 70 * f) + ".png"),
                  ByteImage(4, 4, 1));
    }
  }
  const Dataset dataset = open_dataset(folder.path());
  ASSERT_EQ(dataset.cameras.size(), 2U);
  EXPECT_EQ(dataset.frames[0].images.size(), 5U);
  EXPECT_EQ(dataset.frames[1].images.size(), 4U);
  EXPECT_FALSE(dataset.frames[1].images.contains(2));
  EXPECT_TRUE(dataset.frames[1].images.contains(4));
  EXPECT_NEAR(dataset.info.sequences.front().fps, 1e6 / 40'070, 0.05);
  EXPECT_NE(finding_of(dataset.findings, "frames-by-time"), nullptr);
}

TEST(FrameNames, SecondsWithAFraction_AreInOrderBeyondASecond) {
  fixtures::TemporaryDirectory folder;
  for (int c = 0; c < 2; ++c) {
    const fs::path camera = folder / "images" / ("cam" + std::to_string(c));
    fs::create_directories(camera);
    for (int f = 0; f < 6; ++f) {
      const int milliseconds = 1'800 + 100 * f + c;  // on from 1.8 s
      char name[40];
      std::snprintf(name, sizeof name, "17000000%02d.%03d%s.png", milliseconds / 1000,
                    milliseconds % 1000, c == 0 ? "000" : "");
      write_image(camera / name, ByteImage(4, 4, 1));
    }
  }
  const Dataset dataset = open_dataset(folder.path());
  ASSERT_EQ(dataset.cameras.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    ASSERT_EQ(dataset.frames[c].images.size(), 6U) << c;
    EXPECT_THAT(dataset.frames[c].images.find(0)->file.filename().string(),
                ::testing::StartsWith("1700000001.80"));
    EXPECT_THAT(dataset.frames[c].images.find(5)->file.filename().string(),
                ::testing::StartsWith("1700000002.30"));
  }
  EXPECT_NEAR(dataset.info.sequences.front().fps, 10, 0.01);
  EXPECT_NE(finding_of(dataset.findings, "frames-by-time"), nullptr);
}

TEST(FrameNames, DatesAndTimes_AreInOrderBeyondASecond) {
  const auto name_of = [](int style, int c, int milliseconds) {
    const int second = milliseconds / 1000;
    const int minute = 59 + second / 60;  // on from 14:59
    char name[80];
    const char* formats[] = {"2026-11-29_%02d-%02d-%02d.%03d.png", "20261129_%02d%02d%02d_%03d.png",
                             "cam7_20261129%02d%02d%02d%03d.png",
                             "2026-11-29T%02d:%02d:%02d.%03d000Z.png"};
    std::snprintf(name, sizeof name, formats[style], 14 + minute / 60, minute % 60, second % 60,
                  milliseconds % 1000 + c);
    return std::string(name);
  };
  for (int style = 0; style < 4; ++style) {
    SCOPED_TRACE(style);
    fixtures::TemporaryDirectory folder;
    constexpr int kFrames = 8;
    for (int c = 0; c < 2; ++c) {
      const fs::path camera = folder / "images" / ("cam" + std::to_string(c));
      fs::create_directories(camera);
      for (int f = 0; f < kFrames; ++f) {
        write_image(camera / name_of(style, c, 59'600 + 100 * f), ByteImage(4, 4, 1));
      }
    }
    const Dataset dataset = open_dataset(folder.path());
    ASSERT_EQ(dataset.cameras.size(), 2U);
    for (int c = 0; c < 2; ++c) {
      const FrameLocations& images = dataset.frames[static_cast<std::size_t>(c)].images;
      ASSERT_EQ(images.size(), std::size_t{kFrames});
      for (int f = 0; f < kFrames; ++f) {
        EXPECT_EQ(images.find(f)->file.filename().string(), name_of(style, c, 59'600 + 100 * f));
      }
    }
    EXPECT_NEAR(dataset.info.sequences.front().fps, 10, 1e-6);
    EXPECT_NE(finding_of(dataset.findings, "frames-by-time"), nullptr);
  }
}

TEST(FrameNames, NumbersBehindADate_AreFrames) {
  const auto stamped = [](const std::vector<std::string>& names) {
    const auto stamps = time_stamps(names);
    return std::any_of(stamps.begin(), stamps.end(), [](const auto& one) { return one; });
  };
  EXPECT_FALSE(stamped({"2026-11-29_000001.png", "2026-11-29_000002.png"}));
  EXPECT_FALSE(stamped({"20261129_142601_0001.png", "20261129_142601_0002.png"}));
  EXPECT_FALSE(stamped({"20261129_142601_001.png", "20261129_142601_002.png"}));
  EXPECT_FALSE(stamped({"20261129_000001_003.png", "20261129_000002_003.png"}));  // a camera's
  EXPECT_FALSE(stamped({"2026-13-29_14-26-01.000.png", "2026-13-29_14-26-02.000.png"}));
  EXPECT_FALSE(stamped({"2026-11-29_14-26-01_cam3_000123.png"}));
  EXPECT_FALSE(stamped({"000001.png", "000002.png"}));
  EXPECT_TRUE(stamped({"2026-11-29_14-26-01.000_cam2.png", "2026-11-29_14-26-02.000_cam2.png"}));
  EXPECT_TRUE(stamped({"2026-11-29_14-26-59.png", "2026-11-29_14-27-00.png"}));
  EXPECT_EQ(time_stamps({"1970-01-02_00-00-01.5.png"})[0].value_or(0), 0);  // before any recording
  EXPECT_EQ(time_stamps({"2026-11-29_14-26-01.5.png"})[0].value_or(0), 1'795'962'361'500'000'000);
}

}  // namespace
}  // namespace atelier
