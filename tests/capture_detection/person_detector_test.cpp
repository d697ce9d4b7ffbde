// Crops of people and what the person detector's outputs mean.

#include "capture/detection/person_detector.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/capture_detection/people_outputs.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

/// A box of one anchor, px of the detector's input, with its hips and the point above.
void put_box(std::vector<NetworkOutput>& outputs, int anchor, float logit,
             const std::vector<float>& values) {
  outputs[0].values[static_cast<std::size_t>(anchor)] = logit;
  std::copy(values.begin(), values.end(), outputs[1].values.begin() + std::ptrdiff_t{anchor} * 12);
}

TEST(PersonCrop, PointsOfACrop_ReturnFromTheImage) {
  const PersonCrop crop{{300, 200}, 150, 0.7};
  for (const Eigen::Vector2d& point :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.3, 0.9), Eigen::Vector2d(1.5, -1)}) {
    EXPECT_LT((into_crop(crop, from_crop(crop, point)) - point).norm(), 1e-12);
  }
  EXPECT_LT((from_crop(crop, {0.5, 0.5}) - crop.center).norm(), 1e-12);
}

TEST(PersonCrop, PersonOfAnyDirection_StandsUprightInTheCrop) {
  for (const double angle : {0.0, 0.5, 1.6, 3.1, -2.0}) {
    const Eigen::Vector2d up(std::sin(angle), -std::cos(angle));
    const PersonCrop crop = person_crop({50, 60}, Eigen::Vector2d(50, 60) + 40 * up);
    EXPECT_NEAR(crop.side, 100, 1e-9);
    const Eigen::Vector2d head = into_crop(crop, Eigen::Vector2d(50, 60) + 40 * up);
    EXPECT_NEAR(head.x(), 0.5, 1e-9) << angle;
    EXPECT_NEAR(head.y(), 0.1, 1e-9) << angle;
  }
}

TEST(PersonCrop, Overlap_IsSharedAreaOfUnion) {
  const PersonCrop a{{10, 10}, 10, 0};
  EXPECT_DOUBLE_EQ(overlap(a, a), 1);
  EXPECT_DOUBLE_EQ(overlap(a, {{15, 10}, 10, 1}), 50.0 / 150);
  EXPECT_DOUBLE_EQ(overlap(a, {{30, 10}, 10, 0}), 0);
}

TEST(PersonCrop, SampledRamp_IsExactAndBlackOutside) {
  ByteImage ramp(40, 20, 1);
  for (int y = 0; y < ramp.height; ++y) {
    for (int x = 0; x < ramp.width; ++x) {
      ramp.at(x, y) = static_cast<std::uint8_t>(4 * x + 2 * y);
    }
  }
  const PersonCrop crop{{20, 10}, 12, std::numbers::pi / 2};
  const Image pixels = sampled_crop(ramp, crop, 8, 0, 1);
  for (int v = 0; v < 8; ++v) {
    for (int u = 0; u < 8; ++u) {
      const Eigen::Vector2d at = from_crop(crop, Eigen::Vector2d((u + 0.5) / 8, (v + 0.5) / 8));
      const double expected = (4 * (at.x() - 0.5) + 2 * (at.y() - 0.5)) / 255;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(pixels.at(u, v, c), expected, 1e-5);
      }
    }
  }
  const Image whole = sampled_crop(ramp, image_crop(40, 20), 8, -1, 1);
  EXPECT_EQ(whole.at(4, 0, 0), -1);  // the image is twice as wide as high
  EXPECT_GT(whole.at(4, 4, 0), -1);
  ATELIER_EXPECT_REFUSED(sampled_crop(ramp, {{1, 1}, 0, 0}, 8, 0, 1), LogicError, "without area");
  ATELIER_EXPECT_REFUSED(sampled_crop(ByteImage(4, 4, 4), crop, 8, 0, 1), LogicError,
                         "1 or 3 channels");
}

TEST(PersonDetector, Anchors_AreCellCentres) {
  const auto& anchors = person_anchors();
  ASSERT_EQ(anchors.rows(), 2254);
  EXPECT_NEAR(anchors(0, 0), 4.0 / 224, 1e-12);
  EXPECT_NEAR(anchors(1, 0), 4.0 / 224, 1e-12);
  EXPECT_NEAR(anchors(2, 0), 12.0 / 224, 1e-12);
  EXPECT_NEAR(anchors(1568, 1), 8.0 / 224, 1e-12);         // 28 x 28 x 2 before
  EXPECT_NEAR(anchors(1568 + 392, 0), 16.0 / 224, 1e-12);  // 14 x 14 x 2 before
  EXPECT_NEAR(anchors(2253, 1), 208.0 / 224, 1e-12);
}

TEST(PersonDetector, Box_BecomesACropOfTheImage) {
  auto outputs = nobody_outputs();
  // Anchor 0 at (4, 4): hips 108 px right and down of it, in the middle; the circle 56 px above.
  put_box(outputs, 0, 3, {108, 108, 40, 90, 108, 108, 108, 52, 0, 0, 0, 0});
  const auto people = decode_people(outputs, 1920, 1080, 0.5);
  ASSERT_EQ(people.size(), 1U);
  EXPECT_NEAR(people[0].score, 1 / (1 + std::exp(-3.0)), 1e-9);
  EXPECT_NEAR(people[0].crop.center.x(), 960, 1e-3);
  EXPECT_NEAR(people[0].crop.center.y(), 540, 1e-3);
  EXPECT_NEAR(people[0].crop.side, 2.5 * 56 * 1920 / 224, 1e-2);
  EXPECT_NEAR(people[0].crop.turn, 0, 1e-9);
}

TEST(PersonDetector, OverlappingBoxes_AreOnePersonAndOthersApart) {
  auto outputs = nobody_outputs();
  put_box(outputs, 0, 1, {50, 100, 40, 90, 50, 100, 50, 60, 0, 0, 0, 0});
  put_box(outputs, 1, 1, {54, 100, 40, 90, 54, 100, 54, 60, 0, 0, 0, 0});
  put_box(outputs, 2, 2, {142, 100, 40, 90, 142, 100, 142, 60, 0, 0, 0, 0});  // anchor 8 px on
  put_box(outputs, 3, -1, {100, 20, 40, 30, 100, 20, 100, 10, 0, 0, 0, 0});   // too unsure
  const auto people = decode_people(outputs, 224, 224, 0.5);
  ASSERT_EQ(people.size(), 2U);
  EXPECT_GT(people[0].score, people[1].score);
  EXPECT_NEAR(people[0].crop.center.x(), 154, 1e-3);
  EXPECT_NEAR(people[1].crop.center.x(), 56, 1e-3);  // the mean of 54 and 58
}

TEST(PersonDetector, BoxesWithoutArea_EndAndProposeNothing) {
  auto outputs = nobody_outputs();
  for (int a = 0; a < 2254; ++a) {
    put_box(outputs, a, 5, std::vector<float>(12, 0.0F));
  }
  EXPECT_TRUE(decode_people(outputs, 224, 224, 0.5).empty());
}

TEST(PersonDetector, OtherOutputs_AreRefused) {
  auto outputs = nobody_outputs();
  outputs[1].shape = {2254, 11};
  ATELIER_EXPECT_REFUSED(decode_people(outputs, 10, 10, 0.5, "a.onnx"), DataError,
                         "no output [1,2254,12]");
  ATELIER_EXPECT_REFUSED(decode_people({}, 10, 10, 0.5, "a.onnx"), DataError, "a.onnx");
}

}  // namespace
}  // namespace atelier::fixtures
