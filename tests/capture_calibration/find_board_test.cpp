// Boards in images that were rendered through known lenses: which corner is where, to a fraction of
// a pixel.

#include "capture/calibration/find_board.h"

#include <Eigen/Geometry>
#include <cstdio>
#include <opencv2/aruco/charuco.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/calibration/calibrate.h"
#include "capture/calibration/charuco.h"
#include "capture/input/board_pictures.h"
#include "core/io/image_file.h"
#include "tests/capture/oriented_jpeg.h"
#include "tests/capture_calibration/rendered_board.h"
#include "tests/capture_calibration/synthetic_boards.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

enum class Glass { Straight, Barrel, Fisheye };

Camera camera_with(Glass glass) {
  Camera camera;
  camera.id = "cam";
  camera.width = 720;
  camera.height = 540;
  camera.fx = camera.fy = glass == Glass::Fisheye ? 320 : 560;
  camera.cx = 366.3;
  camera.cy = 262.8;
  if (glass == Glass::Barrel) {
    camera.distortion_model = Distortion::Brown;
    camera.distortion = {-0.35, 0.12, 0.001, -0.0015};
  } else if (glass == Glass::Fisheye) {
    camera.distortion_model = Distortion::Fisheye;
    camera.distortion = {0.04, -0.01, 0.002, 0};
  }
  return camera;
}

/// Before a camera at the origin, large in its image, turned in its plane.
RigidNumbers before(const BoardOptions& board, Glass glass, double turn) {
  const BoardPoints points = board_points(board);
  const Eigen::Vector3d middle(points.col(0).mean(), points.col(1).mean(), 0);
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(-0.25, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
  const double away =
      (glass == Glass::Fisheye ? 0.9 : 1.5) * std::max(board.columns, board.rows) * board.square;
  return rigid_of(rotation, Eigen::Vector3d(0.02, -0.01, away) - rotation * middle);
}

struct Offsets {
  double rms = 0;                                  ///< px
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();  ///< px, found less true
};

Offsets offsets(const BoardOptions& board, const Camera& camera, const RigidNumbers& pose,
                const BoardView& view) {
  const BoardPoints points = board_points(board);
  Offsets off;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const int id = view.ids[i];
    const Eigen::Vector2d error =
        view.pixels.row(static_cast<Eigen::Index>(i)).transpose() -
        *project(camera, moved(pose, Eigen::Vector3d(points(id, 0), points(id, 1), 0)));
    off.rms += error.squaredNorm();
    off.mean += error / static_cast<double>(view.ids.size());
  }
  off.rms = std::sqrt(off.rms / static_cast<double>(view.ids.size()));
  return off;
}

BoardOptions charuco_of(int columns, int rows) {
  return {.kind = BoardKind::Charuco, .columns = columns, .rows = rows, .square = 0.05};
}

TEST(Charuco, MarkerSquares_AreThoseThatOpencvPrints) {
  for (const auto& [columns, rows] : {std::pair(5, 7), {6, 8}, {7, 6}, {6, 5}, {3, 3}, {4, 4}}) {
    const auto board = cv::aruco::CharucoBoard::create(
        columns, rows, 1, 0.5F, cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_1000));
    cv::Mat print;
    board->draw(cv::Size(40 * columns, 40 * rows), print, 0, 1);
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(print, board->dictionary, corners, ids);
    ASSERT_EQ(ids.size(), static_cast<std::size_t>(columns * rows / 2));
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const MarkerSquare square = marker_square(ids[i], {columns, false});
      EXPECT_EQ(square.column, static_cast<int>(corners[i][0].x) / 40) << columns << " x " << rows;
      EXPECT_EQ(square.row, static_cast<int>(corners[i][0].y) / 40) << columns << " x " << rows;
    }
  }
}

TEST(Charuco, LegacySquares_AreTheOthers) {
  // 4 x 2 squares: white, black, white, black; black, white, black, white.
  const CharucoPattern even{4, true};
  EXPECT_EQ(marker_square(0, even).column, 0);
  EXPECT_EQ(marker_square(1, even).column, 2);
  EXPECT_EQ(marker_square(2, even).row, 1);
  EXPECT_EQ(marker_square(2, even).column, 1);
  const CharucoPattern odd{3, true};  // two white squares, then one
  EXPECT_EQ(marker_square(1, odd).column, 2);
  EXPECT_EQ(marker_square(2, odd).column, 1);
  EXPECT_EQ(marker_square(2, odd).row, 1);
  EXPECT_EQ(marker_square(3, odd).row, 2);
}

TEST(FindBoard, CharucoOfEitherPattern_IsFoundInPlaceThroughEveryLens) {
  struct Case {
    int columns, rows;
    bool legacy;
    Glass glass;
    double turn;
  };
  const Case cases[] = {{5, 7, false, Glass::Barrel, 0.0},     {6, 8, false, Glass::Barrel, M_PI},
                        {6, 8, true, Glass::Barrel, 0.4},      {7, 6, true, Glass::Fisheye, M_PI},
                        {7, 6, false, Glass::Straight, 0.8},   {5, 4, true, Glass::Straight, 0.0},
                        {4, 5, false, Glass::Fisheye, 1.5708}, {6, 4, true, Glass::Straight, -2.0}};
  for (const Case& one : cases) {
    const BoardOptions board = charuco_of(one.columns, one.rows);
    const Camera camera = camera_with(one.glass);
    const RigidNumbers pose = before(board, one.glass, one.turn);
    const FoundBoard found =
        find_board(rendered(PrintedBoard(board, one.legacy), camera, pose), board);
    const std::string name = std::to_string(one.columns) + " x " + std::to_string(one.rows) +
                             (one.legacy ? " legacy" : "");
    ASSERT_EQ(found.rejected, "") << name;
    EXPECT_EQ(found.legacy, one.legacy) << name;
    EXPECT_GE(found.view.ids.size(), 0.8 * static_cast<double>(board_points(board).rows())) << name;
    const Offsets off = offsets(board, camera, pose, found.view);
    std::printf("%s: %zu corners, rms %.3f px, mean (%.3f, %.3f)\n", name.c_str(),
                found.view.ids.size(), off.rms, off.mean.x(), off.mean.y());
    EXPECT_LT(off.rms, 0.15) << name;
    EXPECT_LT(off.mean.norm(), 0.05) << name;
  }
}

TEST(FindBoard, PartlyHiddenCharuco_KeepsTheNumbersOfItsCorners) {
  const Camera camera = camera_with(Glass::Barrel);
  for (const bool legacy : {false, true}) {
    const BoardOptions board = charuco_of(6, 8);
    const RigidNumbers pose = before(board, Glass::Barrel, 2.9);
    const FoundBoard found =
        find_board(rendered(PrintedBoard(board, legacy), camera, pose, {{300, 250}, 130}), board);
    ASSERT_EQ(found.rejected, "");
    EXPECT_EQ(found.legacy, legacy);
    EXPECT_LT(found.view.ids.size(), 30U);
    EXPECT_GT(found.view.ids.size(), 6U);
    EXPECT_LT(offsets(board, camera, pose, found.view).rms, 0.15);
  }
}

TEST(FindBoard, ChessboardByEitherDetector_HasOneOrderAndPlace) {
  // Even and odd numbers of squares either way, upright, lying and upside down.
  for (const auto& [columns, rows] : {std::pair(10, 7), {9, 6}, {7, 10}, {6, 5}}) {
    for (const Glass glass : {Glass::Straight, Glass::Barrel, Glass::Fisheye}) {
      for (const double turn : {0.1, 1.7, M_PI}) {
        const BoardOptions board{.columns = columns, .rows = rows, .square = 0.05};
        const Camera camera = camera_with(glass);
        const RigidNumbers pose = before(board, glass, turn);
        const ByteImage image = rendered(PrintedBoard(board), camera, pose);
        for (const auto detector : {ChessboardDetector::Quads, ChessboardDetector::Sectors}) {
          const FoundBoard found = find_board(image, board, detector);
          const std::string name = std::to_string(columns) + " x " + std::to_string(rows) +
                                   " glass " + std::to_string(static_cast<int>(glass)) +
                                   " turned " + std::to_string(turn) + " detector " +
                                   std::to_string(static_cast<int>(detector));
          if (!found.rejected.empty()) {
            std::printf("%s: %s\n", name.c_str(), found.rejected.c_str());
            EXPECT_NE(glass, Glass::Straight) << name;
            continue;
          }
          const Offsets off = offsets(board, camera, pose, found.view);
          EXPECT_LT(off.rms, 0.15) << name;
          EXPECT_LT(off.mean.norm(), 0.05) << name;
        }
      }
    }
  }
}

TEST(FindBoard, SymmetricChessboard_RunsClockwise) {
  const BoardOptions board{.columns = 8, .rows = 6, .square = 0.05};
  const Camera camera = camera_with(Glass::Straight);
  for (const double turn : {0.1, 1.7, M_PI}) {
    const ByteImage image =
        rendered(PrintedBoard(board), camera, before(board, Glass::Straight, turn));
    for (const auto detector : {ChessboardDetector::Quads, ChessboardDetector::Sectors}) {
      const FoundBoard found = find_board(image, board, detector);
      ASSERT_EQ(found.rejected, "");
      const Eigen::RowVector2d first = found.view.pixels.row(0);
      const Eigen::RowVector2d across = found.view.pixels.row(6) - first;
      const Eigen::RowVector2d down = found.view.pixels.row(28) - first;
      EXPECT_GT(across.x() * down.y() - across.y() * down.x(), 0);
    }
  }
}

TEST(FindBoard, WrongCharuco_IsNamedWithTheRightOne) {
  const Camera camera = camera_with(Glass::Straight);
  const BoardOptions board = charuco_of(6, 8);
  const RigidNumbers pose = before(board, Glass::Straight, 0.2);
  const ByteImage image = rendered(PrintedBoard(board, true), camera, pose);
  BoardOptions wrong = charuco_of(8, 6);  // columns and rows exchanged
  EXPECT_THAT(find_board(image, wrong).rejected,
              HasSubstr("the markers do not lie as on a board of 8 x 6 squares"));
  auto nearby = nearby_board(image, wrong);
  ASSERT_TRUE(nearby.has_value());
  EXPECT_EQ(nearby->setting, "--board.columns 6");
  wrong = board;
  wrong.dictionary = "5x5_100";
  EXPECT_THAT(find_board(image, wrong).rejected, HasSubstr("no marker of the dictionary 5x5_100"));
  nearby = nearby_board(image, wrong);
  ASSERT_TRUE(nearby.has_value());
  EXPECT_EQ(nearby->setting, "--board.dictionary 4x4_50");
  wrong = {.columns = 6, .rows = 8};
  nearby = nearby_board(image, wrong);
  ASSERT_TRUE(nearby.has_value());
  EXPECT_THAT(nearby->setting, HasSubstr("--board.kind charuco"));
  ByteImage inverted = image;
  for (std::uint8_t& value : inverted.data) {
    value = static_cast<std::uint8_t>(255 - value);
  }
  nearby = nearby_board(inverted, board);
  ASSERT_TRUE(nearby.has_value());
  EXPECT_EQ(nearby->setting, "--board.inverted");
  const BoardOptions plain{.columns = 9, .rows = 6, .square = 0.05};
  const ByteImage chessboard =
      rendered(PrintedBoard(plain), camera, before(plain, Glass::Straight, 0.2));
  nearby = nearby_board(chessboard, charuco_of(9, 6));
  ASSERT_TRUE(nearby.has_value());
  EXPECT_EQ(nearby->setting, "--board.kind chessboard");
}

TEST(FindBoard, OtherShareOfMarkers_IsFoundAllTheSame) {
  const Camera camera = camera_with(Glass::Straight);
  BoardOptions board = charuco_of(5, 7);
  board.marker = 0.55;
  const RigidNumbers pose = before(board, Glass::Straight, 0.2);
  const ByteImage image = rendered(PrintedBoard(board), camera, pose);
  board.marker = 0.8;
  const FoundBoard found = find_board(image, board);
  ASSERT_EQ(found.rejected, "");
  EXPECT_LT(offsets(board, camera, pose, found.view).rms, 0.15);
}

TEST(Calibrate, RenderedLegacyCharuco_GivesTheTrueLensesAndSaysThePattern) {
  BoardOptions board = charuco_of(6, 8);
  board.square = 0.1;
  const PrintedBoard printed(board, true);
  std::vector<Camera> truth = arc_of_cameras(2);
  for (Camera& camera : truth) {  // half the size
    camera.width /= 2;
    camera.height /= 2;
    camera.fx /= 2;
    camera.fy /= 2;
    camera.cx /= 2;
    camera.cy /= 2;
  }
  const TemporaryDirectory folder;
  Random random{47, 1};
  for (int frame = 0; frame < 8; ++frame) {
    // Held boards turn their backs to the cameras.
    const double middle = board_points(board).col(1).mean();
    const RigidNumbers turned =
        rigid_of(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix(),
                 Eigen::Vector3d(0, 2 * middle, 0));
    const RigidNumbers pose = chained(held_board(board, random, 0.25, 0.6, 0.15), turned);
    for (const Camera& camera : truth) {
      write_image(folder / (camera.id + "_" + std::to_string(frame) + ".png"),
                  rendered(printed, camera, pose));
    }
  }
  const BoardPictures pictures = find_boards(open_board_pictures(folder.path()), board);
  ASSERT_EQ(pictures.rig.size(), 2U);
  EXPECT_GE(pictures.views.size(), 14U);
  ASSERT_EQ(pictures.findings.size(), 1U);
  EXPECT_EQ(pictures.findings[0].code, "board-pattern");
  EXPECT_THAT(pictures.findings[0].what, HasSubstr("legacy pattern"));
  const Calibration found = calibrate(pictures.rig, pictures.views, board);
  std::printf("rms %.3f px; fx %.2f of %.2f, cx %.2f of %.2f, cy %.2f of %.2f\n", found.rms,
              found.cameras[1].fx, truth[1].fx, found.cameras[1].cx, truth[1].cx,
              found.cameras[1].cy, truth[1].cy);
  EXPECT_LT(found.rms, 0.3);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_NEAR(found.cameras[c].fx, truth[c].fx, 0.005 * truth[c].fx);
    EXPECT_NEAR(found.cameras[c].cx, truth[c].cx, 6);  // eight boards near the middle
    EXPECT_NEAR(found.cameras[c].cy, truth[c].cy, 6);
  }
  EXPECT_NEAR((camera_center(found.cameras[0]) - camera_center(found.cameras[1])).norm(),
              (camera_center(truth[0]) - camera_center(truth[1])).norm(), 0.01);
}

TEST(FindBoards, ImagesThatExifTurns_AreCalibratedAsStoredAndSaid) {
  const TemporaryDirectory folder;
  for (const int number : {1, 2}) {
    write_oriented(folder / ("left0" + std::to_string(number) + ".jpg"), 64, 48, 6);
    write_oriented(folder / ("right0" + std::to_string(number) + ".jpg"), 64, 48, 1);
  }
  const BoardPictures pictures = find_boards(open_board_pictures(folder.path()), {});
  ASSERT_EQ(pictures.rig.size(), 2U);
  EXPECT_EQ(pictures.rig[0].camera.width, 64);
  ASSERT_EQ(pictures.findings.size(), 1U);
  EXPECT_EQ(pictures.findings[0].code, "image-orientation");
  EXPECT_EQ(pictures.findings[0].place, "left");
}

}  // namespace
}  // namespace atelier::fixtures
