// Calibration of rigs whose ground truth is known: what is found, how sure it is, what it refuses.

#include "capture/calibration/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/calibration/board_pose.h"
#include "capture/calibration/bundle.h"
#include "core/error.h"
#include "tests/capture_calibration/synthetic_boards.h"
#include "tests/support/finite_differences.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

const BoardOptions kBoard{.columns = 9, .rows = 6, .square = 0.06};

bool has(const Calibration& calibration, const std::string& code, const std::string& place = "") {
  return std::any_of(calibration.findings.begin(), calibration.findings.end(),
                     [&](const Finding& finding) {
                       return finding.code == code && (place.empty() || finding.place == place);
                     });
}

/// b's camera as the first camera sees it, of the ground truth and of what was found.
RigidNumbers relative(const std::vector<Camera>& cameras, std::size_t a, std::size_t b) {
  const auto pose = [&](std::size_t c) {
    return rigid_of(cameras[c].camera_from_world_rotation,
                    cameras[c].camera_from_world_translation);
  };
  return chained(pose(b), inverse_of(pose(a)));
}

TEST(Lens, LensJacobians_MatchFiniteDifferences) {
  Random random{3, 1};
  for (const Distortion model : {Distortion::None, Distortion::Brown, Distortion::Fisheye}) {
    LensNumbers lens;
    lens << 800, 810, 320, 240, -0.2, 0.05, 0.001, -0.002, 0.01, 0.02, -0.01, 0.003;
    for (int trial = 0; trial < 5; ++trial) {
      const Eigen::Vector3d point(uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5),
                                  uniform(random, 0.8, 2));
      const LensJacobian jacobian = lens_jacobian(model, lens, point);
      const auto by_point = finite_difference_jacobian(
          [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return *lens_pixel(model, lens, x); },
          point);
      const auto by_lens = finite_difference_jacobian(
          [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
            return *lens_pixel(model, LensNumbers(x), point);
          },
          lens);
      EXPECT_LT(jacobian_error(jacobian.by_point, by_point), 1e-6);
      EXPECT_LT(jacobian_error(jacobian.by_lens, by_lens), 1e-6);
    }
  }
}

TEST(Lens, LensPixel_MatchesCameraProjection) {
  const std::vector<Camera> cameras = arc_of_cameras(2);
  const Eigen::Vector3d point(0.2, -0.1, 0.3);
  for (Camera camera : cameras) {
    camera.distortion[4] = 0.01;
    camera.distortion[6] = 0.02;
    EXPECT_LT(
        (*lens_pixel(camera.distortion_model, lens_of(camera), camera_from_world(camera, point)) -
         *project(camera, point))
            .norm(),
        1e-9);
  }
}

TEST(RigidNumbers, RigidTransforms_ChainInvertAndDifferentiate) {
  Random random{5, 1};
  for (int trial = 0; trial < 20; ++trial) {
    RigidNumbers a;
    RigidNumbers b;
    for (int i = 0; i < 6; ++i) {
      a[i] = uniform(random, -1.5, 1.5);
      b[i] = uniform(random, -1.5, 1.5);
    }
    if (trial == 0) {
      a.head<3>().setZero();
    }
    const Eigen::Vector3d x(0.3, -0.7, 1.1);
    EXPECT_LT((moved(chained(a, b), x) - moved(a, moved(b, x))).norm(), 1e-12);
    EXPECT_LT((moved(inverse_of(a), moved(a, x)) - x).norm(), 1e-12);
    const auto numeric = finite_difference_jacobian(
        [&](const Eigen::VectorXd& y) -> Eigen::VectorXd { return moved(RigidNumbers(y), x); }, a);
    EXPECT_LT(jacobian_error(moved_jacobian(a, x), numeric), 1e-6);
  }
}

TEST(Bundle, SolverJacobians_MatchFiniteDifferences) {
  Random random{7, 1};
  const std::vector<Camera> cameras = arc_of_cameras(1);
  Bundle bundle;
  bundle.points = board_points(kBoard);
  Bundle::Eye eye;
  eye.lens = lens_of(cameras[0]);
  eye.camera_from_world =
      rigid_of(cameras[0].camera_from_world_rotation, cameras[0].camera_from_world_translation);
  bundle.eyes = {eye};
  bundle.world_from_board = {held_board(kBoard, random, 0)};
  const Bundle::Sight sight{0, 0, 11, {600, 500}};
  const SightJacobian jacobian = sight_jacobian(bundle, sight);
  const auto error_at = [&](const Bundle& at) -> Eigen::VectorXd {
    return sight_jacobian(at, sight).error;
  };
  const auto by_lens = finite_difference_jacobian(
      [&](const Eigen::VectorXd& x) {
        Bundle at = bundle;
        at.eyes[0].lens = x;
        return error_at(at);
      },
      eye.lens);
  const auto by_camera = finite_difference_jacobian(
      [&](const Eigen::VectorXd& x) {
        Bundle at = bundle;
        at.eyes[0].camera_from_world = x;
        return error_at(at);
      },
      eye.camera_from_world);
  const auto by_board = finite_difference_jacobian(
      [&](const Eigen::VectorXd& x) {
        Bundle at = bundle;
        at.world_from_board[0] = x;
        return error_at(at);
      },
      bundle.world_from_board[0]);
  EXPECT_LT(jacobian_error(jacobian.by_lens, by_lens), 1e-5);
  EXPECT_LT(jacobian_error(jacobian.by_camera, by_camera), 1e-5);
  EXPECT_LT(jacobian_error(jacobian.by_board, by_board), 1e-5);
}

TEST(Calibrate, ExactCorners_GiveTheExactRig) {
  Random random{11, 1};
  const std::vector<Camera> truth = arc_of_cameras(3);
  const auto views = views_of(truth, kBoard, held_boards(kBoard, 14, random), 0, random);
  const Calibration found = calibrate(unknown_rig(truth), views, kBoard);
  EXPECT_TRUE(found.converged);
  EXPECT_LT(found.rms, 1e-3);
  EXPECT_TRUE(found.rejected.empty());
  for (std::size_t c = 0; c < truth.size(); ++c) {
    EXPECT_NEAR(found.cameras[c].fx, truth[c].fx, 0.2);
    EXPECT_NEAR(found.cameras[c].cx, truth[c].cx, 0.2);
    EXPECT_NEAR(found.cameras[c].distortion[0], truth[c].distortion[0], 2e-3);
    EXPECT_TRUE(found.quality[c].in_rig);
    EXPECT_GT(found.quality[c].coverage, 0.25);
    EXPECT_LT((relative(found.cameras, 0, c) - relative(truth, 0, c)).norm(), 1e-3);
  }
}

TEST(Calibrate, ChainOfCamerasWithoutCommonFrame_IsCalibrated) {
  // Camera 0 and 2 never see the board at once.
  Random random{13, 1};
  const std::vector<Camera> truth = arc_of_cameras(3);
  auto views = views_of(truth, kBoard, held_boards(kBoard, 24, random), 0.1, random);
  std::erase_if(views, [](const BoardView& view) {
    return view.camera_idx == (view.frame_id % 2 == 0 ? 0 : 2);
  });
  const Calibration found = calibrate(unknown_rig(truth), views, kBoard);
  EXPECT_LT((relative(found.cameras, 0, 2) - relative(truth, 0, 2)).norm(), 0.02);
  EXPECT_LT(found.rms, 0.2);
}

TEST(Calibrate, SingleMarker_ConnectsKnownLenses) {
  Random random{17, 1};
  const BoardOptions marker{.kind = BoardKind::Marker, .square = 0.2};
  const std::vector<Camera> truth = arc_of_cameras(4);
  const auto views = views_of(truth, marker, held_boards(marker, 25, random, 0.75), 0.2, random);
  std::vector<RigCamera> rig;
  for (const Camera& camera : truth) {
    rig.push_back({camera, true});
    rig.back().camera.camera_from_world_rotation.setIdentity();
  }
  const Calibration found = calibrate(rig, views, marker);
  for (std::size_t c = 1; c < truth.size(); ++c) {
    EXPECT_EQ(found.cameras[c].fx, truth[c].fx);
    EXPECT_LT((relative(found.cameras, 0, c) - relative(truth, 0, c)).norm(), 0.03);
  }
  EXPECT_LT(found.rms, 0.35);
}

TEST(Calibrate, StandardDeviations_MatchScatterOverRepeats) {
  const std::vector<Camera> truth = arc_of_cameras(2);
  Random placing{19, 1};
  const auto boards = held_boards(kBoard, 10, placing, 0.25);
  constexpr int kRepeats = 24;
  constexpr double kNoise = 0.3;
  CalibrateOptions options;
  options.lens = LensChoice::Radial2;
  std::vector<Camera> straight = truth;
  for (Camera& camera : straight) {
    camera.distortion = {-0.15, 0.06};
  }
  Eigen::ArrayXXd found(kRepeats, 5);
  Eigen::ArrayXd said = Eigen::ArrayXd::Zero(5);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    Random random{100 + static_cast<std::uint64_t>(repeat), 1};
    const auto views = views_of(straight, kBoard, boards, kNoise, random);
    const Calibration one = calibrate(unknown_rig(straight), views, kBoard, options);
    ASSERT_TRUE(one.converged);
    const Eigen::Vector3d centre = camera_center(one.cameras[1]);
    found.row(repeat) << one.cameras[1].fx, one.cameras[1].cx, one.cameras[1].distortion[0],
        centre.x(), centre.z();
    const CameraQuality& q = one.quality[1];
    Eigen::Array<double, 5, 1> deviation;
    deviation << q.lens_deviation[0], q.lens_deviation[2], q.lens_deviation[4],
        q.centre_deviation.x(), q.centre_deviation.z();
    said += deviation / kRepeats;
    EXPECT_NEAR(one.sigma, kNoise, 0.06);
  }
  for (int i = 0; i < 5; ++i) {
    const double mean = found.col(i).mean();
    const double scatter = std::sqrt((found.col(i) - mean).square().sum() / (kRepeats - 1));
    std::printf("number %d: scatter %.4g, said %.4g\n", i, scatter, said[i]);
    // A standard deviation of 24 draws is itself known to 15%.
    EXPECT_GT(said[i], 0.6 * scatter);
    EXPECT_LT(said[i], 1.7 * scatter);
  }
}

TEST(Calibrate, ViewOfOtherInstant_IsLeftOut) {
  Random random{23, 1};
  const std::vector<Camera> truth = arc_of_cameras(3);
  auto views = views_of(truth, kBoard, held_boards(kBoard, 16, random), 0.1, random);
  int moved_frame = -1;
  for (BoardView& view : views) {
    if (view.camera_idx == 1 && view.frame_id == 5) {
      view.pixels.array() += 30;
      moved_frame = view.frame_id;
    }
  }
  ASSERT_EQ(moved_frame, 5);
  const Calibration found = calibrate(unknown_rig(truth), views, kBoard);
  ASSERT_EQ(found.rejected.size(), 1U);
  EXPECT_EQ(found.rejected[0].camera_id, "cam1");
  EXPECT_EQ(found.rejected[0].frame_id, 5);
  EXPECT_THAT(found.rejected[0].why, HasSubstr("from where the others put the board"));
  EXPECT_LT(found.rms, 0.2);
}

TEST(Calibrate, LensModel_IsChosenFromTheViews) {
  Random random{29, 1};
  const auto boards = held_boards(kBoard, 16, random, 0.0);
  const std::vector<Camera> straight = arc_of_cameras(1, 0);
  const Calibration none =
      calibrate(unknown_rig(straight), views_of(straight, kBoard, boards, 0.1, random), kBoard);
  EXPECT_EQ(none.quality[0].lens, "none");
  std::vector<Camera> fisheye = straight;
  fisheye[0].distortion_model = Distortion::Fisheye;
  fisheye[0].distortion = {0.05, -0.01};
  fisheye[0].fx = fisheye[0].fy = 500;
  std::vector<RigidNumbers> near;
  for (const RigidNumbers& board : boards) {
    near.push_back(board);
    near.back().tail<3>() += Eigen::Vector3d(0, 0.3, 1.2);
  }
  const Calibration wide =
      calibrate(unknown_rig(fisheye), views_of(fisheye, kBoard, near, 0.05, random), kBoard);
  EXPECT_LT(wide.rms, 0.1);
  EXPECT_NEAR(wide.cameras[0].fx, 500, 5);
}

TEST(Calibrate, MissingViews_GiveFindings) {
  Random random{31, 1};
  const std::vector<Camera> truth = arc_of_cameras(4);
  auto views = views_of(truth, kBoard, held_boards(kBoard, 16, random), 0.1, random);
  // Camera 3 sees boards that nobody else sees, camera 2 sees too few.
  for (BoardView& view : views) {
    view.frame_id += view.camera_idx == 3 ? 1000 : 0;
  }
  int kept = 0;
  std::erase_if(views, [&](const BoardView& view) { return view.camera_idx == 2 && ++kept > 2; });
  const Calibration found = calibrate(unknown_rig(truth), views, kBoard);
  EXPECT_TRUE(has(found, "calibration-unconnected", "cam3"));
  EXPECT_TRUE(has(found, "calibration-few-views", "cam2"));
  EXPECT_TRUE(found.quality[0].in_rig);
  EXPECT_FALSE(found.quality[2].in_rig);
  EXPECT_FALSE(found.quality[3].in_rig);
  EXPECT_NEAR(found.cameras[3].fx, truth[3].fx, 10);  // its lens is known all the same
  EXPECT_TRUE(has_errors(found.findings));
}

TEST(Calibrate, FrontoParallelBoards_AreRefusedOrReported) {
  // Parallel to the image, a board says nothing about the focal length.
  Random random{37, 1};
  const std::vector<Camera> truth = arc_of_cameras(1, 0);
  std::vector<RigidNumbers> boards;
  const Eigen::Matrix3d facing = truth[0].camera_from_world_rotation.transpose();
  for (int i = 0; i < 8; ++i) {
    boards.push_back(rigid_of(facing, facing * Eigen::Vector3d(-0.25 + 0.02 * i, -0.15, 0)));
  }
  const auto views = views_of(truth, kBoard, boards, 0.2, random);
  ASSERT_GE(views.size(), 6U);
  try {
    const Calibration found = calibrate(unknown_rig(truth), views, kBoard);
    EXPECT_TRUE(has(found, "calibration-focal-open", "cam0")) << found.quality[0].lens_deviation[0];
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("focal length open"));
  }
}

TEST(Calibrate, TooFewViewsAndSymmetricBoards_AreRefused) {
  Random random{41, 1};
  const std::vector<Camera> truth = arc_of_cameras(2);
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(truth), {}, kBoard), DataError,
                         "no image shows the board");
  const auto two = views_of(truth, kBoard, held_boards(kBoard, 2, random), 0, random);
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(truth), two, kBoard), DataError, "of 4 at least");
  const BoardOptions symmetric{.columns = 8, .rows = 6};
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(truth), {}, symmetric), DataError,
                         "look the same upside down");
  auto apart = views_of(truth, kBoard, held_boards(kBoard, 12, random), 0, random);
  for (BoardView& view : apart) {
    view.frame_id += 100 * view.camera_idx;
  }
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(truth), apart, kBoard), DataError,
                         "no two of them see the board at the same instant");
}

TEST(Calibrate, OutOfRangeCameraOrCorner_IsRefused) {
  BoardView view;
  view.camera_idx = 2;
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(arc_of_cameras(2)), {view}, kBoard), LogicError,
                         "a camera that is not there");
  view.camera_idx = 0;
  view.ids = {1, 2};
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(arc_of_cameras(2)), {view}, kBoard), LogicError,
                         "as many numbers as pixels");
  view.ids = {400};
  view.pixels.resize(1, 2);
  ATELIER_EXPECT_REFUSED(calibrate(unknown_rig(arc_of_cameras(2)), {view}, kBoard), LogicError,
                         "a corner that the board does not have");
}

TEST(StandUp, CalibratedRig_IsTurnedUprightOntoTheGround) {
  Random random{43, 1};
  const std::vector<Camera> truth = arc_of_cameras(3);
  auto boards = held_boards(kBoard, 14, random);
  // Frame 14: it lies on the ground at (0, -0.2, 0), face up.
  Eigen::Matrix3d flat;
  flat << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  boards.push_back(rigid_of(flat, Eigen::Vector3d(-0.27, -0.2, 0.18)));
  const auto views = views_of(truth, kBoard, boards, 0, random);
  const Calibration found = calibrate(unknown_rig(truth), views, kBoard);
  const Calibration grounded = stand_up(found, kBoard, 14);
  for (std::size_t c = 0; c < truth.size(); ++c) {
    EXPECT_NEAR(camera_center(grounded.cameras[c]).y(), camera_center(truth[c]).y() + 0.2, 1e-3);
  }
  const Calibration upright = stand_up(found, kBoard);
  const Eigen::Vector3d up = -upright.cameras[1].camera_from_world_rotation.row(1).transpose();
  EXPECT_GT(up.y(), 0.9);
  ATELIER_EXPECT_REFUSED(stand_up(found, kBoard, 99), DataError, "no board of it was used");
}

}  // namespace
}  // namespace atelier::fixtures
