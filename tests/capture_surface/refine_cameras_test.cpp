#include "capture/surface/refine_cameras.h"

#include <Eigen/Geometry>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/capture_stereo/textured_ball.h"

namespace atelier::fixtures {
namespace {

/// Fourteen cameras round a textured ball, with true poses and such as a calibration finds them.
struct BallRig {
  std::vector<Camera> truth, calibrated;
  std::vector<Image> images;
  std::vector<SeenPlace> places;

  /// @param turn   px rms by which directions are off, each axis; @param shift  m, of the places
  explicit BallRig(double turn, double shift = 0.001) {
    const TexturedBall ball;
    Random random{4, 0, 0};
    for (const StereoView& view : ball.views(14, 0.448798951, 160, 160)) {
      truth.push_back(view.camera);
      images.push_back(view.image);
      Camera found = view.camera;
      const Eigen::Vector3d off = turn / found.fx * normal3(random);
      const Eigen::Vector3d centre = camera_center(found) + 0.3 * turn / found.fx * normal3(random);
      const double angle = off.norm();
      if (angle > 0) {
        found.camera_from_world_rotation =
            Eigen::AngleAxisd(angle, off / angle).toRotationMatrix() *
            found.camera_from_world_rotation;
      }
      found.camera_from_world_translation = -found.camera_from_world_rotation * centre;
      calibrated.push_back(found);
    }
    for (int k = 0; k < 1500; ++k) {
      SeenPlace place;
      place.normal = normal3(random).normalized();
      place.point = (ball.radius + shift * normal(random)) * place.normal;
      for (std::size_t c = 0; c < truth.size(); ++c) {
        if (place.normal.dot((camera_center(truth[c]) - place.point).normalized()) > 0.6) {
          place.views.push_back(static_cast<int>(c));
        }
      }
      places.push_back(std::move(place));
    }
  }

  static Eigen::Vector3d normal3(Random& random) {
    const double x = normal(random);
    const double y = normal(random);
    return {x, y, normal(random)};
  }

  /// m: how far rays through the same true place pass each other, on average over all pairs.
  double disagreement(const std::vector<Camera>& cameras) const {
    double sum = 0;
    int count = 0;
    for (const SeenPlace& place : places) {
      const Eigen::Vector3d point = 0.3 * place.normal;
      for (const int a : place.views) {
        for (const int b : place.views) {
          const auto i = static_cast<std::size_t>(a);
          const auto j = static_cast<std::size_t>(b);
          if (a < b) {
            const auto one = ray_direction(cameras[i], *project(truth[i], point));
            const auto other = ray_direction(cameras[j], *project(truth[j], point));
            const Eigen::Vector3d across = one->cross(*other).normalized();
            sum += std::abs(across.dot(camera_center(cameras[i]) - camera_center(cameras[j])));
            ++count;
          }
        }
      }
    }
    return sum / count;
  }
};

TEST(RefineCameras, MatchingRays_AreBroughtTogether) {
  const BallRig rig(0.8);
  const RefinedCameras refined = refine_cameras(rig.calibrated, rig.images, rig.places);
  EXPECT_THAT(refined.matches, ::testing::Each(::testing::Gt(50)));
  EXPECT_LT(refined.after, 0.3 * refined.before);
  EXPECT_LT(rig.disagreement(refined.cameras), 0.25 * rig.disagreement(rig.calibrated));
}

TEST(RefineCameras, ExactCameras_StayUnchanged) {
  const BallRig rig(0);
  const RefinedCameras refined = refine_cameras(rig.calibrated, rig.images, rig.places);
  for (std::size_t i = 0; i < rig.truth.size(); ++i) {
    for (const SeenPlace& place : rig.places) {
      const auto before = project(rig.truth[i], place.point);
      const auto after = project(refined.cameras[i], place.point);
      ASSERT_LT((*after - *before).norm(), 0.15);
    }
  }
}

TEST(RefineCameras, CameraWithoutMatches_StaysUnchanged) {
  BallRig rig(0.8);
  std::fill(rig.images[3].data.begin(), rig.images[3].data.end(), 0.5F);
  const RefinedCameras refined = refine_cameras(rig.calibrated, rig.images, rig.places);
  EXPECT_EQ(refined.matches[3], 0);
  EXPECT_LT(
      (refined.cameras[3].camera_from_world_rotation - rig.calibrated[3].camera_from_world_rotation)
          .norm(),
      1e-9);
  EXPECT_GT(refined.matches[6], 50);
}

TEST(RefineCameras, TooFewPlaces_ChangeNothing) {
  BallRig rig(0.8);
  rig.places.resize(50);
  const RefinedCameras refined = refine_cameras(rig.calibrated, rig.images, rig.places);
  for (std::size_t i = 0; i < rig.truth.size(); ++i) {
    EXPECT_EQ(refined.cameras[i].camera_from_world_rotation,
              rig.calibrated[i].camera_from_world_rotation);
  }
}

TEST(RefineCameras, MismatchedSizesOrViewOutOfRange_AreRefused) {
  BallRig rig(0);
  EXPECT_THROW(refine_cameras(rig.calibrated, {}, rig.places), LogicError);
  rig.places[7].views = {14};
  EXPECT_THROW(refine_cameras(rig.calibrated, rig.images, rig.places), LogicError);
  rig.places[7].views = {-1};
  EXPECT_THROW(refine_cameras(rig.calibrated, rig.images, rig.places), LogicError);
  rig.places.clear();
  rig.images[0] = Image(10, 10, 1);
  EXPECT_THROW(refine_cameras(rig.calibrated, rig.images, rig.places), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
