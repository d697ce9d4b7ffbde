// The built-in detector on a whole capture, where its networks are.

#include "capture/people/detect_people.h"

#include <algorithm>
#include <filesystem>

#include <gtest/gtest.h>

#include "capture/frame_reader.h"
#include "capture/image_turns.h"
#include "capture/keypoint_schema.h"
#include "capture/layouts/open_dataset.h"
#include "capture/people/second_look.h"
#include "core/median.h"
#include "tests/capture/oriented_jpeg.h"
#include "tests/capture/small_capture.h"
#include "tests/capture_detection/bright_networks.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

/// The first frames of a capture alone.
Dataset first_frames(Dataset dataset, int last) {
  for (CameraFrames& camera : dataset.frames) {
    std::vector<int> later;
    for (const auto& [frame, place] : camera.images) {
      if (frame > last) {
        later.push_back(frame);
      }
    }
    for (const int frame : later) {
      camera.images.erase(frame);
    }
  }
  return dataset;
}

std::string real_networks() {
  const std::string folder = default_network_folder();
  return std::filesystem::exists(std::filesystem::path(folder) / "person.onnx") ? folder : "";
}

/// The person of one image by the small landmark network.
PeopleInImage people_of(const ByteImage& image) {
  Limits limits;
  limits.worker_cpu_seconds = 300;
  return find_people(read_people_networks(real_networks(), LandmarkNetwork::Lite), {{{image}, {}}},
                     {}, limits)[0][0];
}

/// px of an image 1000 rows high, between points that are seen.
double median_distance(const DetectedPoints& a, const DetectedPoints& b, int height) {
  std::vector<double> distances;
  for (Index k = 0; k < a.rows(); ++k) {
    if (a(k, 2) > 0.5 && b(k, 2) > 0.5) {
      distances.push_back((a.row(k).head<2>() - b.row(k).head<2>()).norm() * 1000 / height);
    }
  }
  return distances.empty() ? 1e9 : median(distances);
}

ByteImage part_of(const ByteImage& image, int width, int height, int scale, bool grey) {
  ByteImage result(width * scale, height * scale, grey ? 1 : 3);
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) {
      for (int c = 0; c < result.channels; ++c) {
        result.at(x, y, c) = image.at(x / scale, y / scale, grey ? 1 : c);
      }
    }
  }
  return result;
}

TEST(DetectPeople, UnreadableImage_IsAFindingAndTheRestGoesOn) {
  const TemporaryDirectory folder;
  SmallCapture small;
  small.detections = false;
  write_small_capture(folder / "capture", small);
  for (const Camera& camera : small.cameras) {
    for (const int frame : small.frames) {
      write_image(folder / "capture/images" / camera.id / (frame_name(frame) + ".png"),
                  ByteImage(camera.width, camera.height, 3, 255));
    }
  }
  const Dataset dataset = open_dataset(folder / "capture");
  std::filesystem::resize_file(
      folder / "capture/images" / small.cameras[1].id / (frame_name(4) + ".png"), 60);
  int told = 0;
  const PeopleCount count =
      detect_people(dataset, bright_networks(), {},
                    [&](Index camera, int frame, const PeopleInImage& people, const ByteImage&) {
                      EXPECT_FALSE(camera == 1 && frame == 4);
                      EXPECT_EQ(people.size(), 1U);
                      ++told;
                    });
  EXPECT_EQ(told, 5);
  EXPECT_EQ(count.images, 5);
  ASSERT_EQ(count.findings.size(), 1U);
  EXPECT_EQ(count.findings[0].code, "image-broken");
  EXPECT_EQ(count.findings[0].place, small.cameras[1].id + " frame 4");
}

// The detector is given images as they are shown, and what it finds is of the stored ones.
TEST(DetectPeople, ImagesThatExifTurns_AreDetectedAsTheyAreShown) {
  for (const int orientation : {1, 3, 6, 8}) {
    const TemporaryDirectory folder;
    SmallCapture small;
    small.detections = false;
    write_small_capture(folder / "capture", small);
    for (const Camera& camera : small.cameras) {
      for (const int frame : small.frames) {
        const std::filesystem::path stem =
            folder / "capture/images" / camera.id / frame_name(frame);
        std::filesystem::remove(stem.string() + ".png");
        ByteImage image(camera.width, camera.height, 3, 255);
        for (int y = 0; y < 16; ++y) {
          for (int x = 0; x < 16; ++x) {
            image.at(x, y, 1) = 0;
          }
        }
        write_oriented(stem.string() + ".jpg", image, static_cast<char>(orientation));
      }
    }
    const double quarters = quarters_shown(orientation);
    DetectPeopleOptions options;
    options.views = false;
    int told = 0;
    detect_people(open_dataset(folder / "capture"), bright_networks(), options,
                  [&](Index, int, const PeopleInImage& people, const ByteImage& image) {
                    ++told;
                    ASSERT_EQ(image.width, 64);
                    ASSERT_EQ(image.height, 80);
                    EXPECT_LT(image.at(5, 5, 1), 60);
                    EXPECT_GT(image.at(58, 74, 1), 200);
                    ASSERT_EQ(people.size(), 1U);
                    const PersonLandmarks& one = people[0];
                    // The person is upright in the image as it is shown.
                    EXPECT_NEAR(std::remainder(one.crop.turn + quarters * 1.5707963267948966,
                                               6.283185307179586),
                                0, 1e-6)
                        << orientation;
                    EXPECT_LT((one.crop.center - Eigen::Vector2d(32, 40)).norm(), 4) << orientation;
                    EXPECT_LT((one.points.row(0).head<2>().transpose() - one.crop.center).norm(), 1)
                        << orientation;
                  });
    EXPECT_EQ(told, 6);
  }
}

TEST(DetectPeople, PersonInAnyImage_IsFoundOrNobodyIs) {
  ATELIER_TEST_FILE(folder, "pose2sim_demo/single");
  if (real_networks().empty()) {
    GTEST_SKIP() << "no networks at " << default_network_folder();
  }
  const Dataset dataset = open_dataset(folder);
  FrameReader reader(dataset);
  const ByteImage image = *reader.byte_image(2, frame_ids(dataset)[0]);
  const PeopleInImage plain = people_of(image);
  ASSERT_EQ(plain.size(), 1U);

  ByteImage turned = image;
  std::reverse(turned.data.begin(), turned.data.end());
  for (int y = 0; y < turned.height; ++y) {
    for (int x = 0; x < turned.width; ++x) {
      std::swap(turned.at(x, y, 0), turned.at(x, y, 2));
    }
  }
  const PeopleInImage upside_down = people_of(turned);
  ASSERT_EQ(upside_down.size(), 1U);
  DetectedPoints back = upside_down[0].points;
  back.col(0) = image.width - back.col(0).array();
  back.col(1) = image.height - back.col(1).array();
  EXPECT_LT(median_distance(back, plain[0].points, image.height), 15);

  const PeopleInImage large = people_of(part_of(image, image.width, image.height, 4, false));
  ASSERT_EQ(large.size(), 1U);
  DetectedPoints small = large[0].points;
  small.leftCols<2>() /= 4;
  EXPECT_LT(median_distance(small, plain[0].points, image.height), 6);

  const PeopleInImage grey = people_of(part_of(image, image.width, image.height, 1, true));
  ASSERT_EQ(grey.size(), 1U);
  EXPECT_LT(median_distance(grey[0].points, plain[0].points, image.height), 10);

  // Half a person: whatever is said of the rest lies outside and was not found.
  const int waist = static_cast<int>(plain[0].points(23, 1));
  for (const PersonLandmarks& one : people_of(part_of(image, image.width, waist, 1, false))) {
    const Keypoints2d points = found_points(one, image.width, waist, 0.1);
    EXPECT_LT(points.col(1).maxCoeff(), waist);
  }
}

TEST(DetectPeople, RealRecording_IsWhereOpenPoseSawThePerson) {
  ATELIER_TEST_FILE(folder, "pose2sim_demo/single");
  const std::string networks = real_networks();
  if (networks.empty()) {
    GTEST_SKIP() << "no networks at " << default_network_folder();
  }
  const Dataset dataset = first_frames(open_dataset(folder), 2);
  FrameReader reader(dataset);
  const KeypointSchema& ours = keypoint_schema(kBuiltInSchema);
  const KeypointSchema& theirs = keypoint_schema(dataset.info.keypoint_schema);
  std::vector<double> distances;
  const PeopleCount count = detect_people(
      dataset, read_people_networks(networks, LandmarkNetwork::Lite), {},
      [&](Index camera, int frame, const PeopleInImage& people, const ByteImage& image) {
        ASSERT_EQ(people.size(), 1U);
        const Keypoints2d points = found_points(people[0], image.width, image.height, 0.1);
        const auto reference = reader.keypoints(camera, frame);
        ASSERT_FALSE(reference.empty());
        for (const char* part : {"shoulder", "elbow", "wrist", "hip", "knee", "ankle"}) {
          for (const std::string side : {"left_", "right_"}) {
            const auto a = points.row(find_keypoint(ours, side + part));
            const auto b = reference[0].points.row(find_keypoint(theirs, side + part));
            if (a[2] > 0.5 && b[2] > 0.5) {
              distances.push_back((a.head<2>() - b.head<2>()).norm() * 1000 / image.height);
            }
          }
        }
      });
  EXPECT_EQ(count.people, count.images);
  EXPECT_TRUE(count.findings.empty());
  ASSERT_GT(distances.size(), 40U);
  EXPECT_LT(median(distances), 12);  // left for right would be a limb's breadth and more
}

}  // namespace
}  // namespace atelier::fixtures
