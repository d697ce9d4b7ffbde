#include "capture/stereo/halved.h"

#include <gtest/gtest.h>

namespace atelier::fixtures {
namespace {

TEST(Halved, Pixels_AreMeansOfFourPerChannel) {
  Image image(4, 2, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 4; ++x) {
      image.at(x, y, 0) = static_cast<float>(10 * y + x);
      image.at(x, y, 1) = 7;
    }
  }
  const Image half = halved(image);
  ASSERT_EQ(half.width, 2);
  ASSERT_EQ(half.height, 1);
  EXPECT_FLOAT_EQ(half.at(0, 0, 0), (0 + 1 + 10 + 11) / 4.0F);
  EXPECT_FLOAT_EQ(half.at(1, 0, 0), (2 + 3 + 12 + 13) / 4.0F);
  EXPECT_FLOAT_EQ(half.at(1, 0, 1), 7);
}

TEST(Halved, OddSizes_KeepTheirLastPixels) {
  Image image(3, 3, 1);
  image.at(2, 2) = 5;
  const Image half = halved(image);
  EXPECT_EQ(half.width, 2);
  EXPECT_FLOAT_EQ(half.at(1, 1), 5);
}

TEST(Halved, HalvedCamera_ProjectsToHalfThePixel) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 500;
  camera.cx = 311;
  camera.cy = 244;
  camera.distortion_model = Distortion::Brown;
  camera.distortion[0] = -0.1;
  const Camera half = halved(camera);
  const Eigen::Vector3d point(0.3, -0.2, 2);
  EXPECT_LT((*project(half, point) - *project(camera, point) / 2).norm(), 1e-12);
}

TEST(Halved, HalvedLabels_KeepTheGreatest) {
  ByteImage labels(2, 2, 1);
  labels.at(1, 0) = 3;
  labels.at(0, 1) = 9;
  EXPECT_EQ(halved(labels).at(0, 0), 9);
}

}  // namespace
}  // namespace atelier::fixtures
