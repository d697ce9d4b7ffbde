#include "capture/dome.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

double angle_between(const Camera& a, const Camera& b) {
  Eigen::Vector3d p = camera_center(a);
  Eigen::Vector3d q = camera_center(b);
  p.y() = q.y() = 0;
  return std::acos(p.normalized().dot(q.normalized())) * 180 / std::numbers::pi;
}

TEST(Dome, CameraPairs_StandOnPostsOfAlternatingHeight) {
  const std::vector<Camera> cameras =
      dome_cameras({.cameras = 16, .width = 800, .height = 1000, .jitter = 0}, {1, 2});
  ASSERT_EQ(cameras.size(), 16U);
  for (std::size_t i = 0; i < 16; i += 2) {
    EXPECT_NEAR(angle_between(cameras[i], cameras[i + 1]), 15, 1e-9);
    EXPECT_NEAR(camera_center(cameras[i]).y(), i / 2 % 2 == 0 ? 0.5 : 2.4, 1e-9);
    EXPECT_NO_THROW(check_camera(cameras[i]));
  }
  EXPECT_NEAR(angle_between(cameras[0], cameras[2]), 45, 1e-9);
}

TEST(Dome, EveryCamera_SeesTheWholeSubject) {
  for (const Camera& camera : dome_cameras({.cameras = 10, .width = 400, .height = 480}, {7, 1})) {
    for (const double y : {0.02, 1.0, 1.9}) {
      for (const double x : {-0.45, 0.0, 0.45}) {
        const auto pixel = project(camera, {x, y, 0.1});
        ASSERT_TRUE(pixel.has_value());
        EXPECT_GT(pixel->minCoeff(), 0);
        EXPECT_LT(pixel->x(), camera.width);
        EXPECT_LT(pixel->y(), camera.height);
      }
    }
  }
}

TEST(Dome, CalibrationNoise_HasRequestedRms) {
  const std::vector<Camera> truth =
      dome_cameras({.cameras = 4, .width = 800, .height = 1000}, {3, 4});
  for (const double rms : {0.05, 0.2, 1.0}) {
    const std::vector<Camera> found = calibrated_cameras(truth, rms, {3, 5});
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_NEAR(reprojection_rms(truth[i], found[i]), rms, 0.02 * rms);
      EXPECT_EQ(found[i].gain, Eigen::Vector3d::Ones());
    }
  }
  EXPECT_NEAR(reprojection_rms(truth[0], calibrated_cameras(truth, 0, {3, 5})[0]), 0, 1e-9);
}

TEST(Dome, ImpossibleDomes_AreRefused) {
  ATELIER_EXPECT_REFUSED(dome_cameras({.cameras = 7, .pairs = true}, {}), LogicError, "posts");
  ATELIER_EXPECT_REFUSED(dome_cameras({.cameras = 1}, {}), LogicError, "cameras");
  ATELIER_EXPECT_REFUSED(dome_cameras({.radius = 0}, {}), LogicError, "radius");
  ATELIER_EXPECT_REFUSED(calibrated_cameras({}, -1, {}), LogicError, "rms");
}

}  // namespace
}  // namespace atelier
