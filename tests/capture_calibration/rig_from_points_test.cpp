// Cameras posed by points that they see at once: rigs whose ground truth is known, and a real one.

#include "capture/calibration/rig_from_points.h"

#include <Eigen/Geometry>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/calibration/lens.h"
#include "capture/input/board_pictures.h"
#include "capture/input/keypoint_rig.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "tests/capture_calibration/synthetic_boards.h"
#include "tests/support/refusals.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

/// A cloud that a person's joints could be, over some frames.
std::vector<PointSight> cloud_sights(const std::vector<Camera>& cameras, int count, double noise,
                                     double outliers, Random& random) {
  std::vector<PointSight> sights;
  for (int p = 0; p < count; ++p) {
    const Eigen::Vector3d place(uniform(random, -0.4, 0.4), uniform(random, -0.8, 0.8),
                                uniform(random, -0.4, 0.4));
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const auto pixel = project(cameras[c], place);
      const Eigen::Vector2d off(noise * normal(random), noise * normal(random));
      const bool wrong = uniform(random, 0, 1) < outliers;
      const Eigen::Vector2d elsewhere(uniform(random, 0, 1280), uniform(random, 0, 960));
      if (pixel && uniform(random, 0, 1) < 0.9) {
        sights.push_back(
            {static_cast<int>(c), p, wrong ? elsewhere : Eigen::Vector2d(*pixel + off)});
      }
    }
  }
  return sights;
}

RigidNumbers pose_of(const Camera& camera) {
  return rigid_of(camera.camera_from_world_rotation, camera.camera_from_world_translation);
}

/// Largest errors of relative poses: rad, and m once the baseline of the first two is the true one.
struct RigError {
  double turn = 0;
  double place = 0;
};
RigError rig_error(const std::vector<Camera>& found, const std::vector<Camera>& truth) {
  RigError error;
  const auto relative = [](const std::vector<Camera>& cameras, std::size_t c) {
    return chained(pose_of(cameras[c]), inverse_of(pose_of(cameras[0])));
  };
  const double scale = relative(truth, 1).tail<3>().norm() / relative(found, 1).tail<3>().norm();
  for (std::size_t c = 1; c < truth.size(); ++c) {
    const RigidNumbers a = relative(truth, c);
    const RigidNumbers b = relative(found, c);
    error.turn = std::max(error.turn,
                          Eigen::AngleAxisd(rotation_of(a).transpose() * rotation_of(b)).angle());
    error.place = std::max(error.place, (a.tail<3>() - scale * b.tail<3>()).norm());
  }
  return error;
}

std::vector<Camera> without_poses(std::vector<Camera> cameras) {
  for (Camera& camera : cameras) {
    camera.camera_from_world_rotation.setIdentity();
    camera.camera_from_world_translation.setZero();
  }
  return cameras;
}

TEST(RigFromPoints, ExactPoints_GiveTheExactRigUpToItsSize) {
  Random random{53, 1};
  const std::vector<Camera> truth = arc_of_cameras(4);
  const PointRig rig =
      rig_from_points(without_poses(truth), cloud_sights(truth, 200, 0, 0, random));
  EXPECT_THAT(rig.in_rig, ::testing::Each(true));
  EXPECT_TRUE(rig.converged);
  const RigError error = rig_error(rig.cameras, truth);
  EXPECT_LT(error.turn, 1e-5);
  EXPECT_LT(error.place, 1e-4);
}

TEST(RigFromPoints, NoisyPointsWithOutliers_GiveTheRigAsSureAsItSays) {
  Random random{59, 1};
  const std::vector<Camera> truth = arc_of_cameras(4);
  const PointRig rig =
      rig_from_points(without_poses(truth), cloud_sights(truth, 600, 3, 0.1, random));
  EXPECT_THAT(rig.in_rig, ::testing::Each(true));
  const RigError error = rig_error(rig.cameras, truth);
  std::printf("off by %.4f rad, %.4f m; sigma %.2f px\n", error.turn, error.place, rig.sigma);
  EXPECT_LT(error.turn, 0.01);
  EXPECT_LT(error.place, 0.02);
  EXPECT_NEAR(rig.sigma, 3, 0.5);
  int worlds = 0;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const double turn = std::sqrt(rig.pose_covariance[c].diagonal().head<3>().sum());
    worlds += turn == 0 ? 1 : 0;
    EXPECT_LT(turn, 0.01);
  }
  EXPECT_EQ(worlds, 1);
}

TEST(RigFromPoints, CameraWithTooFewPoints_StaysOutside) {
  Random random{61, 1};
  const std::vector<Camera> truth = arc_of_cameras(3);
  auto sights = cloud_sights(truth, 200, 1, 0, random);
  std::erase_if(sights, [](const PointSight& s) { return s.camera_idx == 2 && s.point > 20; });
  const PointRig rig = rig_from_points(without_poses(truth), sights);
  EXPECT_TRUE(rig.in_rig[0]);
  EXPECT_TRUE(rig.in_rig[1]);
  EXPECT_FALSE(rig.in_rig[2]);
}

/// Points beyond some 60 baselines: OpenCV's recoverPose takes none of them for an inlier and
/// returns a pose all the same.
TEST(RigFromPoints, CamerasNearlyAtOnePlace_AreNoRig) {
  Random random{71, 1};
  std::vector<Camera> near = arc_of_cameras(3);
  const double distance = camera_center(near[0]).norm();
  near[1] = near[0];
  near[1].id = "01";
  near[1].camera_from_world_translation.x() += distance / 80;
  for (const double noise : {0.0, 1.0}) {
    const std::vector<Camera> two(near.begin(), near.begin() + 2);
    const PointRig pair =
        rig_from_points(without_poses(two), cloud_sights(two, 300, noise, 0, random));
    EXPECT_THAT(pair.in_rig, ::testing::Each(false)) << noise;
    // With a third camera further off, all are placed by it.
    const PointRig rig =
        rig_from_points(without_poses(near), cloud_sights(near, 300, noise, 0, random));
    EXPECT_THAT(rig.in_rig, ::testing::Each(true)) << noise;
    const RigidNumbers apart =
        chained(pose_of(rig.cameras[2]), inverse_of(pose_of(rig.cameras[0])));
    const RigidNumbers truth = chained(pose_of(near[2]), inverse_of(pose_of(near[0])));
    EXPECT_LT(Eigen::AngleAxisd(rotation_of(apart).transpose() * rotation_of(truth)).angle(), 0.01)
        << noise;
  }
}

TEST(RigFromPoints, CamerasAtOnePlaceOrWithoutPoints_AreNoRig) {
  Random random{67, 1};
  std::vector<Camera> one_place = arc_of_cameras(2);
  one_place[1].camera_from_world_rotation =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()) * one_place[0].camera_from_world_rotation;
  one_place[1].camera_from_world_translation =
      -one_place[1].camera_from_world_rotation * camera_center(one_place[0]);
  const PointRig turned =
      rig_from_points(without_poses(one_place), cloud_sights(one_place, 300, 0.5, 0, random));
  EXPECT_THAT(turned.in_rig, ::testing::Each(false));
  const PointRig none = rig_from_points(arc_of_cameras(2), {});
  EXPECT_THAT(none.in_rig, ::testing::Each(false));
  EXPECT_TRUE(none.points.empty());
  ATELIER_EXPECT_REFUSED(rig_from_points(arc_of_cameras(2), {{2, 0, {1, 1}}}), LogicError,
                         "what is not there");
}

TEST(LensFit, LensesOfOtherShapes_AreScaledAsTheImagesWere) {
  Dataset lenses;
  Camera camera;
  camera.id = "a";
  camera.width = 1088;
  camera.height = 1920;
  camera.fx = camera.fy = 1600;
  camera.cx = 500;
  camera.cy = 1000;
  lenses.cameras = {camera};
  RigCamera image;
  image.camera.id = "a";
  image.camera.width = 1080;
  image.camera.height = 1920;
  ATELIER_EXPECT_REFUSED(with_lenses({image}, lenses), DataError, "--lens-fit");
  const Camera cropped = with_lenses({image}, lenses, LensFit::Cropped)[0].camera;
  EXPECT_EQ(cropped.fx, 1600);
  EXPECT_EQ(cropped.cx, 496);
  EXPECT_EQ(cropped.cy, 1000);
  const Camera padded = with_lenses({image}, lenses, LensFit::Padded)[0].camera;
  const double scale = 1080.0 / 1088;
  EXPECT_NEAR(padded.fy, 1600 * scale, 1e-9);
  EXPECT_NEAR(padded.cx, 500 * scale, 1e-9);
  EXPECT_NEAR(padded.cy, 960 + 40 * scale, 1e-9);
  const Camera stretched = with_lenses({image}, lenses, LensFit::Stretched)[0].camera;
  EXPECT_NEAR(stretched.fx, 1600 * scale, 1e-9);
  EXPECT_EQ(stretched.fy, 1600);
  EXPECT_NEAR(stretched.cx, 500 * scale, 1e-9);
  EXPECT_EQ(stretched.cy, 1000);
}

TEST(KeypointRig, RealTrial_AgreesWithItsCalibration) {
  ATELIER_TEST_FILE(folder, "pose2sim_demo/single");
  DatasetOptions options;
  options.layout = "qualisys";
  const Dataset capture = open_dataset(folder, options);
  std::vector<RigCamera> rig;
  for (const Camera& camera : capture.cameras) {
    rig.push_back({camera, true});
  }
  for (RigCamera& camera : rig) {
    camera.camera = without_poses({camera.camera})[0];
  }
  const Calibration found =
      calibrate_by_keypoints(rig, capture, {.stature = 1.7, .max_frames = 100});
  EXPECT_TRUE(found.findings.empty()) << to_string(found.findings.front());
  const RigError error = rig_error(found.cameras, capture.cameras);
  std::printf("off by %.4f rad, %.4f m; rms %.1f px over %d places\n", error.turn, error.place,
              found.rms, found.points);
  // The published calibration is by markers, ours by what a detector takes for joints.
  EXPECT_LT(error.turn, 0.03);
  EXPECT_LT(error.place, 0.2);
  // As sure as it says, to a factor: centres of the others against the first.
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_LT(found.quality[c].centre_deviation.norm(), 0.05);
    EXPECT_GT(camera_center(found.cameras[c]).y(), 0.5);  // above the ground, Y up
    EXPECT_LT(camera_center(found.cameras[c]).y(), 3);
    const Eigen::Vector3d looks = found.cameras[c].camera_from_world_rotation.row(2).transpose();
    EXPECT_LT(looks.dot(camera_center(found.cameras[c])), 0);  // at the person
  }
  Dataset blank = capture;
  for (CameraFrames& frames : blank.frames) {
    frames.keypoints.clear();
  }
  ATELIER_EXPECT_REFUSED(calibrate_by_keypoints(rig, blank, {.stature = 1.7}), DataError,
                         "no two cameras see enough");
}

TEST(Calibrate, ImagesOfDifferentInstants_AreNoRigAndGiveLensesAlone) {
  Random random{71, 1};
  const BoardOptions board{.columns = 9, .rows = 6, .square = 0.06};
  const std::vector<Camera> truth = arc_of_cameras(2);
  // Each camera sees boards of its own, under the same numbers.
  std::vector<BoardView> views;
  for (int c = 0; c < 2; ++c) {
    for (BoardView& view : views_of(truth, board, held_boards(board, 12, random), 0.1, random)) {
      if (view.camera_idx == c) {
        views.push_back(view);
      }
    }
  }
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(truth), views, board), DataError,
                         "images of one number put the cameras somewhere else in every view");
  CalibrateOptions alone;
  alone.poses = false;
  const Calibration found = calibrate(unknown_rig(truth), views, board, alone);
  EXPECT_TRUE(found.lenses_alone);
  EXPECT_FALSE(has_errors(found.findings));
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_NEAR(found.cameras[c].fx, truth[c].fx, 5);
    EXPECT_EQ(camera_center(found.cameras[c]), Eigen::Vector3d(0, 0, 0));
  }
  const BoardOptions symmetric{.columns = 8, .rows = 6, .square = 0.06};
  // Nor does it matter then which way up a board is.
  const auto either = views_of(truth, symmetric, held_boards(symmetric, 12, random), 0.1, random);
  EXPECT_NEAR(calibrate(unknown_rig(truth), either, symmetric, alone).cameras[1].fx, truth[1].fx,
              5);
}

}  // namespace
}  // namespace atelier::fixtures
