// What a landmark network's outputs mean.

#include "capture/detection/person_landmarks.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/capture_detection/people_outputs.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

const PersonCrop kTurned{{500, 400}, 512, 0.4};

TEST(PersonLandmarks, Points_AreInTheImageWithTheirVisibility) {
  auto outputs = middle_outputs();
  outputs[2].values[5 * 7] = 192;  // the left ear, a quarter of the crop to the right
  outputs[2].values[5 * 7 + 3] = -2;
  const PersonLandmarks found = decode_landmarks(outputs, kTurned);
  EXPECT_NEAR(found.presence, 0.9, 1e-6);
  ASSERT_EQ(found.points.rows(), 33);
  EXPECT_NEAR(found.points(0, 0), 500, 1e-9);
  EXPECT_NEAR(found.points(0, 1), 400, 1e-9);
  EXPECT_NEAR(found.points(0, 2), 1 / (1 + std::exp(-4.0)), 1e-9);
  EXPECT_NEAR(found.points(7, 0), 500 + 128 * std::cos(0.4), 1e-6);
  EXPECT_NEAR(found.points(7, 1), 400 + 128 * std::sin(0.4), 1e-6);
  EXPECT_NEAR(found.points(7, 2), 1 / (1 + std::exp(2.0)), 1e-9);
  EXPECT_EQ(found.mask.at(100, 100), 255);
}

TEST(PersonLandmarks, LastPoints_SteerTheNextCrop) {
  auto outputs = middle_outputs();
  outputs[2].values[5 * 33] = 128;
  outputs[2].values[5 * 33 + 1] = 160;
  outputs[2].values[5 * 34] = 128;
  outputs[2].values[5 * 34 + 1] = 60;
  const PersonLandmarks found = decode_landmarks(outputs, kTurned);
  EXPECT_NEAR(found.next.side, 2.5 * 2 * 100, 1e-6);
  EXPECT_NEAR(found.next.turn, kTurned.turn, 1e-9);  // straight up in a crop that is turned
  EXPECT_LT((found.next.center - from_crop(kTurned, {0.5, 160.0 / 256})).norm(), 1e-9);
}

TEST(PersonLandmarks, SharpHeatmap_MovesItsPointAndAFlatOneDoesNot) {
  auto outputs = middle_outputs();
  const auto cell = [&](int k, int x, int y) -> float& {
    return outputs[1].values[(static_cast<std::size_t>(k) * 64 + static_cast<std::size_t>(y)) * 64 +
                             static_cast<std::size_t>(x)];
  };
  cell(3, 34, 31) = 20;  // two cells right and one up of (32, 32)
  cell(4, 34, 31) = -1;  // less than one half
  cell(5, 40, 32) = 20;  // beyond the window
  const PersonCrop whole{{128, 128}, 256, 0};
  const PersonLandmarks found = decode_landmarks(outputs, whole);
  EXPECT_NEAR(found.points(3, 0), 4 * 34, 1e-3);
  EXPECT_NEAR(found.points(3, 1), 4 * 31, 1e-3);
  EXPECT_NEAR(found.points(4, 0), 128, 1e-9);
  EXPECT_NEAR(found.points(5, 0), 128, 1e-9);
}

TEST(PersonLandmarks, PointsFarOutside_AreKeptWithoutTheirHeatmap) {
  auto outputs = middle_outputs();
  outputs[2].values[0] = -5000;
  outputs[2].values[1] = 1e9F;
  const PersonLandmarks found = decode_landmarks(outputs, {{0, 0}, 256, 0});
  EXPECT_NEAR(found.points(0, 0), -5128, 1e-3);
}

TEST(PersonLandmarks, OtherOutputs_AreRefused) {
  for (std::size_t missing : {0U, 1U, 2U, 4U}) {
    auto outputs = middle_outputs();
    outputs.erase(outputs.begin() + static_cast<std::ptrdiff_t>(missing));
    ATELIER_EXPECT_REFUSED(decode_landmarks(outputs, kTurned, "b.onnx"), DataError, "b.onnx");
  }
}

}  // namespace
}  // namespace atelier::fixtures
