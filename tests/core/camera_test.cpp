#include "core/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/finite_differences.h"

namespace atelier {
namespace {

Camera make_camera(Distortion model) {
  Camera camera;
  camera.id = "cam";
  camera.width = 800;
  camera.height = 1000;
  camera.fx = 900;
  camera.fy = 910;
  camera.cx = 402.5;
  camera.cy = 497.25;
  camera.distortion_model = model;
  if (model == Distortion::Brown) {
    camera.distortion = {-0.21, 0.08, 0.0007, -0.0004, -0.012, 0.01, -0.003, 0.0005};
  } else if (model == Distortion::Fisheye) {
    camera.distortion = {0.02, -0.011, 0.004, -0.0007};
  }
  camera.camera_from_world_rotation =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, 1, -0.2).normalized()).toRotationMatrix();
  camera.camera_from_world_translation = {0.1, -0.2, 3.0};
  return camera;
}

Eigen::Vector3d random_point(const Camera& camera, Random& random) {
  const Eigen::Vector3d in_camera(uniform(random, -0.8, 0.8), uniform(random, -1, 1),
                                  uniform(random, 2, 5));
  return camera.camera_from_world_rotation.transpose() *
         (in_camera - camera.camera_from_world_translation);
}

class CameraModels : public ::testing::TestWithParam<Distortion> {};

TEST_P(CameraModels, RayThroughProjectedPoint_MeetsThePoint) {
  const Camera camera = make_camera(GetParam());
  Random random{.seed = 7};
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d point = random_point(camera, random);
    const auto pixel = project(camera, point);
    ASSERT_TRUE(pixel.has_value());
    const auto direction = ray_direction(camera, *pixel);
    ASSERT_TRUE(direction.has_value());
    const Eigen::Vector3d expected = (point - camera_center(camera)).normalized();
    EXPECT_LT((*direction - expected).norm(), 1e-9);
  }
}

TEST_P(CameraModels, ProjectionJacobian_MatchesFiniteDifferences) {
  const Camera camera = make_camera(GetParam());
  Random random{.seed = 8};
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d point = random_point(camera, random);
    const auto analytic = project_jacobian(camera, point);
    ASSERT_TRUE(analytic.has_value());
    const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
        [&](const Eigen::VectorXd& x) { return Eigen::VectorXd(*project(camera, x)); }, point);
    EXPECT_LT(fixtures::jacobian_error(*analytic, numeric), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, CameraModels,
                         ::testing::Values(Distortion::None, Distortion::Brown,
                                           Distortion::Fisheye));

TEST(Camera, PointOnOpticalAxis_ProjectsToPrincipalPoint) {
  const Camera camera = make_camera(Distortion::Brown);
  const Eigen::Vector3d ahead =
      camera_center(camera) + 2.0 * camera.camera_from_world_rotation.transpose().col(2);
  EXPECT_LT((*project(camera, ahead) - Eigen::Vector2d(camera.cx, camera.cy)).norm(), 1e-9);
}

TEST(Camera, PointBehindCamera_HasNoPixel) {
  const Camera camera = make_camera(Distortion::None);
  const Eigen::Vector3d behind =
      camera_center(camera) - camera.camera_from_world_rotation.transpose().col(2);
  EXPECT_FALSE(project(camera, behind).has_value());
  EXPECT_FALSE(project_jacobian(camera, behind).has_value());
}

TEST(Camera, PointBeyondDistortionFold_HasNoPixel) {
  Camera camera = make_camera(Distortion::Brown);
  camera.camera_from_world_rotation.setIdentity();
  camera.camera_from_world_translation.setZero();
  camera.distortion = {-0.5, 0, 0, 0, 0, 0, 0, 0};  // r (1 - r^2 / 2) turns back at r = 0.816
  EXPECT_TRUE(project(camera, {0.7, 0, 1}).has_value());
  EXPECT_FALSE(project(camera, {0.9, 0, 1}).has_value());
  // The largest image radius is 0.544: no ray reaches a pixel further out.
  EXPECT_FALSE(ray_direction(camera, {camera.cx + 0.6 * camera.fx, camera.cy}).has_value());
}

TEST(Camera, DistortionFold_LiesWhereTheRadiusTurnsBack) {
  Camera camera = make_camera(Distortion::Brown);
  camera.camera_from_world_rotation.setIdentity();
  camera.camera_from_world_translation.setZero();
  Random random{3, 0, 0};
  int seen = 0;
  int unseen = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const double k1 = uniform(random, -1, 1);
    const double k2 = uniform(random, -1, 1);
    const double k3 = uniform(random, -1, 1);
    camera.distortion = {k1, k2, 0, 0, k3, 0, 0, 0};
    const double r = uniform(random, 0, 1.5);
    const double turn = uniform(random, 0, 6);
    // Of r (1 + k1 r^2 + k2 r^4 + k3 r^6), and of the same over r: both positive, or it has folded.
    const auto turns_back = [&](double at) {
      const double s = at * at;
      return 1 + s * (3 * k1 + s * (5 * k2 + s * 7 * k3)) <= 0 ||
             1 + s * (k1 + s * (k2 + s * k3)) <= 0;
    };
    bool folds = false;
    for (int step = 1; step <= 1000 && !folds; ++step) {
      folds = turns_back(r * step / 1000);
    }
    const bool has_pixel = project(camera, {r * std::cos(turn), r * std::sin(turn), 1}).has_value();
    if (!folds) {
      EXPECT_TRUE(has_pixel) << k1 << " " << k2 << " " << k3 << " at " << r;
      ++seen;
    } else if (turns_back(r)) {
      EXPECT_FALSE(has_pixel) << k1 << " " << k2 << " " << k3 << " at " << r;
      ++unseen;
    }
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(unseen, 1000);
}

/// Bent radius of a lens without tangential terms by a ray's radius, and what undoes it by search.
double bent_radius(const Camera& camera, double r) {
  const std::array<double, 8>& d = camera.distortion;
  if (camera.distortion_model == Distortion::Fisheye) {
    const double t = std::atan(r);
    const double t2 = t * t;
    return t * (1 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
  }
  const double s = r * r;
  const double under = 1 + s * (d[5] + s * (d[6] + s * d[7]));
  return under > 0 ? r * (1 + s * (d[0] + s * (d[1] + s * d[4]))) / under : -1;
}

TEST(Camera, Undistortion_ConvergesUpToTheFoldAndSaysWhereThereIsNone) {
  Camera camera = make_camera(Distortion::Brown);
  camera.camera_from_world_rotation.setIdentity();
  camera.camera_from_world_translation.setZero();
  camera.fx = camera.fy = 1000;
  Random random{17, 0, 0};
  int with_ray = 0;
  int without = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const int kind = trial % 3;  // polynomial, rational, fisheye
    camera.distortion_model = kind == 2 ? Distortion::Fisheye : Distortion::Brown;
    camera.distortion.fill(0);
    const double strength = std::pow(10.0, uniform(random, -2, 0.3));
    camera.distortion[0] = strength * uniform(random, -1, 1);
    camera.distortion[1] = strength * uniform(random, -1, 1);
    if (kind == 2) {
      camera.distortion[2] = 0.3 * strength * uniform(random, -1, 1);
      camera.distortion[3] = 0.1 * strength * uniform(random, -1, 1);
    } else {
      camera.distortion[4] = strength * uniform(random, -1, 1);
      camera.distortion[5] = kind == 1 ? strength * uniform(random, -1, 1) : 0;
      camera.distortion[6] = kind == 1 ? strength * uniform(random, -1, 1) : 0;
    }
    // Search outward: the largest radius before the first fold, in angles so that a fisheye is
    // followed to 89.9 degrees.
    std::vector<double> rays;
    std::vector<double> bent;
    constexpr int kSteps = 20000;
    const double end = kind == 2 ? 1.569 : 1.2;
    bool folds = false;
    for (int step = 0; step <= kSteps; ++step) {
      const double r = std::tan(end * step / kSteps);
      const double b = bent_radius(camera, r);
      if (!bent.empty() && b <= bent.back()) {
        folds = true;
        break;
      }
      if (b > 10) {  // on the way to a pole, where every radius has its ray
        break;
      }
      rays.push_back(r);
      bent.push_back(b);
    }
    const double turn = uniform(random, 0, 6);
    const Eigen::Vector2d way(std::cos(turn), std::sin(turn));
    for (const double share : {0.1, 0.5, 0.9, 0.99, 0.999, 1.001, 1.1, 3.0}) {
      const double wanted = share * bent.back();
      const Eigen::Vector2d pixel = Eigen::Vector2d(camera.cx, camera.cy) + 1000 * wanted * way;
      const auto ray = ray_direction(camera, pixel);
      if (share < 1) {
        ASSERT_TRUE(ray.has_value())
            << "lens " << trial << " at " << share << " of " << bent.back();
        const auto above = std::lower_bound(bent.begin(), bent.end(), wanted);
        const auto at = static_cast<std::size_t>(above - bent.begin());
        const double angle = std::atan2(ray->head<2>().norm(), ray->z());
        EXPECT_LE(angle, std::atan(rays[at]) + 1e-9) << "lens " << trial << " at " << share;
        EXPECT_GE(angle, std::atan(rays[at - 1]) - 1e-9) << "lens " << trial << " at " << share;
        EXPECT_LT((*project(camera, *ray) - pixel).norm(), 1e-5);
        ++with_ray;
      } else if (folds) {
        EXPECT_FALSE(ray.has_value()) << "lens " << trial << " at " << share;
        ++without;
      } else if (ray) {  // beyond the search: right all the same
        EXPECT_LT((*project(camera, *ray) - pixel).norm(), 1e-5);
      }
    }
  }
  EXPECT_GT(with_ray, 2900);
  EXPECT_GT(without, 600);
}

TEST(Camera, FisheyePixelBeyond90Degrees_HasNoRay) {
  // An equidistant lens of 200 degrees: 318 px a radian.
  Camera camera = make_camera(Distortion::Fisheye);
  camera.camera_from_world_rotation.setIdentity();
  camera.camera_from_world_translation.setZero();
  camera.fx = camera.fy = 318;
  camera.distortion.fill(0);
  for (const double degrees : {10.0, 60.0, 85.0, 89.0, 89.9, 89.999}) {
    const double angle = degrees * M_PI / 180;
    const auto ray = ray_direction(camera, {camera.cx + 318 * angle, camera.cy});
    ASSERT_TRUE(ray.has_value()) << degrees;
    EXPECT_NEAR(std::atan2(ray->x(), ray->z()), angle, 1e-8) << degrees;
  }
  for (const double degrees : {90.001, 91.0, 100.0, 170.0}) {
    const double angle = degrees * M_PI / 180;
    EXPECT_FALSE(ray_direction(camera, {camera.cx + 318 * angle, camera.cy}).has_value())
        << degrees;
    EXPECT_FALSE(project(camera, {std::sin(angle), 0, std::cos(angle)}).has_value()) << degrees;
  }
}

TEST(Camera, UndistortionOfOpencvsExample_IsExactAtTheCorner) {
  // k1 = -0.35 at f = 1000: OpenCV's five fixed iterations are 0.6 px off there.
  Camera camera = make_camera(Distortion::Brown);
  camera.fx = camera.fy = 1000;
  camera.cx = 640;
  camera.cy = 360;
  camera.distortion = {-0.35, 0.12};
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0, 0), {1280, 0}, {1280, 720}, {3, 500}}) {
    const auto ray = ray_direction(camera, pixel);
    ASSERT_TRUE(ray.has_value());
    EXPECT_LT((*project(camera, camera_center(camera) + 2 * *ray) - pixel).norm(), 1e-8);
  }
}

TEST(Camera, BrownDistortion_MatchesHandComputedPixel) {
  Camera camera = make_camera(Distortion::Brown);
  camera.camera_from_world_rotation.setIdentity();
  camera.camera_from_world_translation.setZero();
  camera.fx = camera.fy = 1;
  camera.cx = camera.cy = 0;
  camera.distortion = {0.1, 0.01, 0.002, 0.003, 0.001, 0, 0, 0};
  const double x = 0.3;
  const double y = -0.4;
  const double r2 = 0.25;
  const double radial = 1 + 0.1 * r2 + 0.01 * r2 * r2 + 0.001 * r2 * r2 * r2;
  const Eigen::Vector2d expected(x * radial + 2 * 0.002 * x * y + 0.003 * (r2 + 2 * x * x),
                                 y * radial + 0.002 * (r2 + 2 * y * y) + 2 * 0.003 * x * y);
  EXPECT_LT((*project(camera, {x, y, 1}) - expected).norm(), 1e-15);
}

std::string camera_refusal(const Camera& camera) {
  try {
    check_camera(camera, "rig.json");
  } catch (const DataError& error) {
    EXPECT_EQ(error.file, "rig.json");
    return error.what();
  }
  return "";
}

TEST(CameraRefused, ValidCamera_IsAccepted) {
  EXPECT_EQ(camera_refusal(make_camera(Distortion::Brown)), "");
}

TEST(CameraRefused, BadSizeOrIntrinsics_NamesTheField) {
  Camera camera = make_camera(Distortion::None);
  camera.width = 0;
  EXPECT_NE(camera_refusal(camera).find("positive size"), std::string::npos);
  camera = make_camera(Distortion::None);
  camera.fx = -900;
  EXPECT_NE(camera_refusal(camera).find("focal lengths"), std::string::npos);
  camera = make_camera(Distortion::None);
  camera.fy = NAN;
  EXPECT_NE(camera_refusal(camera).find("focal lengths"), std::string::npos);
  camera = make_camera(Distortion::None);
  camera.cx = INFINITY;
  EXPECT_NE(camera_refusal(camera).find("principal point"), std::string::npos);
}

TEST(CameraRefused, IntrinsicsOfNoLens_NameCameraValueAndRange) {
  Camera camera = make_camera(Distortion::None);
  camera.id = "left";
  camera.fx = 1e300;
  camera.fy = 640;
  EXPECT_NE(
      camera_refusal(camera).find("camera 'left': focal lengths 1e+300, 640; expected numbers "
                                  "of pixels above 0, up to 1e+08"),
      std::string::npos)
      << camera_refusal(camera);
  camera.fx = 640;
  camera.cy = -1e12;
  EXPECT_NE(camera_refusal(camera).find("-1e+12; expected pixels from -1e+08 to 1e+08"),
            std::string::npos)
      << camera_refusal(camera);
}

TEST(CameraRefused, MirroringOrScalingRotation_IsRefused) {
  Camera camera = make_camera(Distortion::None);
  camera.camera_from_world_rotation.row(2) *= -1;
  EXPECT_NE(camera_refusal(camera).find("mirrors"), std::string::npos);
  camera = make_camera(Distortion::None);
  camera.camera_from_world_rotation *= 1.001;
  EXPECT_NE(camera_refusal(camera).find("orthonormal"), std::string::npos);
  camera.camera_from_world_rotation(0, 0) = NAN;
  EXPECT_NE(camera_refusal(camera).find("not finite"), std::string::npos);
}

TEST(CameraRefused, BadDistortionGainOrTranslation_NamesTheField) {
  Camera camera = make_camera(Distortion::Brown);
  camera.distortion[3] = NAN;
  EXPECT_NE(camera_refusal(camera).find("distortion"), std::string::npos);
  camera = make_camera(Distortion::Brown);
  camera.gain[1] = 0;
  EXPECT_NE(camera_refusal(camera).find("gain"), std::string::npos);
  camera = make_camera(Distortion::Brown);
  camera.camera_from_world_translation[0] = NAN;
  EXPECT_NE(camera_refusal(camera).find("pose"), std::string::npos);
}

TEST(CameraRefused, NonFinitePixel_HasNoRay) {
  EXPECT_FALSE(ray_direction(make_camera(Distortion::None), {NAN, 3}).has_value());
}

}  // namespace
}  // namespace atelier
