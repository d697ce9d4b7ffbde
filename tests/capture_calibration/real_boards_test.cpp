// Boards in images: drawn ones whose corners are known, and real sets against the calibrations
// that came with them.

#include <Eigen/Cholesky>
#include <cstdio>
#include <fstream>
#include <map>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/calibration/calibrate.h"
#include "capture/calibration/calibration_report.h"
#include "capture/layouts/open_dataset.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "tests/capture_calibration/board_errors.h"
#include "tests/capture_calibration/synthetic_boards.h"
#include "tests/support/refusals.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

/// A flat image of the board, `scale` pixels a square, one square of white round it.
cv::Mat drawn(const BoardOptions& board, int scale) {
  cv::Mat picture;
  if (board.kind == BoardKind::Chessboard) {
    picture = cv::Mat((board.rows + 2) * scale, (board.columns + 2) * scale, CV_8UC1, 255);
    for (int y = 0; y < board.rows; ++y) {
      for (int x = 0; x < board.columns; ++x) {
        if ((x + y) % 2 == 0) {
          picture(cv::Rect((x + 1) * scale, (y + 1) * scale, scale, scale)) = 0;
        }
      }
    }
    return picture;
  }
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_1000);
  if (board.kind == BoardKind::Marker) {
    cv::Mat marker;
    cv::aruco::drawMarker(dictionary, 7, scale, marker, 1);
    picture = cv::Mat(3 * scale, 3 * scale, CV_8UC1, 255);
    marker.copyTo(picture(cv::Rect(scale, scale, scale, scale)));
    return picture;
  }
  cv::aruco::CharucoBoard::create(board.columns, board.rows, 1, static_cast<float>(board.marker),
                                  dictionary)
      ->draw(cv::Size((board.columns + 2) * scale, (board.rows + 2) * scale), picture, scale, 1);
  return picture;
}

/// The drawn board as a camera sees it: a homography, since the lens here is straight.
ByteImage seen(const BoardOptions& board, const Camera& camera, const RigidNumbers& pose) {
  constexpr int kScale = 60;
  const cv::Mat flat = drawn(board, kScale);
  const double unit = board.square / kScale;
  const double shift_x = board.kind == BoardKind::Marker ? 1.5 * kScale : kScale;
  const Eigen::Matrix3d rotation = rotation_of(pose);
  Eigen::Matrix3d plane;
  plane << rotation.col(0), rotation.col(1), pose.tail<3>();
  Eigen::Matrix3d k;
  // OpenCV counts from the first pixel's centre.
  k << camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1;
  Eigen::Matrix3d flat_to_board;
  flat_to_board << unit, 0, (0.5 - shift_x) * unit, 0, unit, (0.5 - shift_x) * unit, 0, 0, 1;
  const Eigen::Matrix3d h = k * plane * flat_to_board;
  cv::Mat matrix(3, 3, CV_64F);
  for (int i = 0; i < 9; ++i) {
    matrix.at<double>(i / 3, i % 3) = h(i / 3, i % 3);
  }
  cv::Mat warped;
  // Twice as large, then smaller: edges as a lens makes them.
  const cv::Mat twice = (cv::Mat_<double>(3, 3) << 2, 0, 0.5, 0, 2, 0.5, 0, 0, 1);
  cv::warpPerspective(flat, warped, twice * matrix, cv::Size(2 * camera.width, 2 * camera.height),
                      cv::INTER_LINEAR, cv::BORDER_CONSTANT, 128);
  cv::resize(warped, warped, cv::Size(camera.width, camera.height), 0, 0, cv::INTER_AREA);
  ByteImage image(camera.width, camera.height, 1);
  for (int y = 0; y < camera.height; ++y) {
    std::copy_n(warped.ptr<std::uint8_t>(y), camera.width,
                image.data.begin() + static_cast<std::ptrdiff_t>(y) * camera.width);
  }
  return image;
}

Camera plain_camera() {
  Camera camera;
  camera.id = "drawn";
  camera.width = 800;
  camera.height = 600;
  camera.fx = camera.fy = 900;
  camera.cx = 400;
  camera.cy = 300;
  return camera;
}

RigidNumbers before_camera(const BoardOptions& board, double turn) {
  const auto points = board_points(board);
  const Eigen::Vector3d middle(points.col(0).mean(), points.col(1).mean(), 0);
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
  return rigid_of(rotation, Eigen::Vector3d(0.02, -0.01, 0.9) - rotation * middle);
}

/// rms distance of what was found from where the corners are.
double corner_error(const BoardOptions& board, const Camera& camera, const RigidNumbers& pose,
                    const BoardView& view) {
  const auto points = board_points(board);
  double sum = 0;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const int id = view.ids[i];
    const auto pixel =
        project(camera, moved(pose, Eigen::Vector3d(points(id, 0), points(id, 1), 0)));
    sum += (*pixel - view.pixels.row(static_cast<Eigen::Index>(i)).transpose()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(view.ids.size()));
}

/// Mean of found less true, px.
Eigen::Vector2d mean_offset(const BoardOptions& board, const Camera& camera,
                            const RigidNumbers& pose, const BoardView& view) {
  const auto points = board_points(board);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const int id = view.ids[i];
    sum += view.pixels.row(static_cast<Eigen::Index>(i)).transpose() -
           *project(camera, moved(pose, Eigen::Vector3d(points(id, 0), points(id, 1), 0)));
  }
  return sum / static_cast<double>(view.ids.size());
}

TEST(FindBoard, DrawnBoardsOfEveryKind_AreFoundInPlace) {
  const Camera camera = plain_camera();
  const BoardOptions boards[] = {
      {.columns = 9, .rows = 6, .square = 0.04},
      {.kind = BoardKind::Charuco, .columns = 6, .rows = 5, .square = 0.06},
      {.kind = BoardKind::Marker, .square = 0.25}};
  for (const BoardOptions& board : boards) {
    for (const double turn : {0.0, 1.3, 3.0}) {
      const RigidNumbers pose = before_camera(board, turn);
      const FoundBoard found = find_board(seen(board, camera, pose), board);
      ASSERT_EQ(found.rejected, "");
      EXPECT_EQ(found.view.ids.size(), static_cast<std::size_t>(board_points(board).rows()));
      // The drawn chessboard starts with a black square, so that its first corner is ours.
      EXPECT_LT(corner_error(board, camera, pose, found.view), 0.4)
          << static_cast<int>(board.kind) << " turned by " << turn << " off by "
          << mean_offset(board, camera, pose, found.view).transpose();
    }
  }
}

TEST(FindBoard, InvertedBoard_IsFoundIfConfigured) {
  const Camera camera = plain_camera();
  BoardOptions board{.kind = BoardKind::Charuco, .columns = 6, .rows = 5, .square = 0.06};
  ByteImage image = seen(board, camera, before_camera(board, 0));
  for (std::uint8_t& value : image.data) {
    value = static_cast<std::uint8_t>(255 - value);
  }
  EXPECT_NE(find_board(image, board).rejected, "");
  board.inverted = true;
  EXPECT_EQ(find_board(image, board).rejected, "");
}

TEST(FindBoard, MismatchedBoard_SaysWhy) {
  const Camera camera = plain_camera();
  const BoardOptions chessboard{.columns = 9, .rows = 6, .square = 0.04};
  const ByteImage image = seen(chessboard, camera, before_camera(chessboard, 0));
  BoardOptions wrong = chessboard;
  wrong.columns = 8;
  wrong.rows = 5;  // inner corners taken for squares
  const auto nearby = nearby_board(image, wrong);
  ASSERT_TRUE(nearby.has_value());
  EXPECT_EQ(nearby->what, "a chessboard of 9 x 6 squares");
  EXPECT_EQ(nearby->setting, "--board.columns 9 --board.rows 6");
  wrong.columns = 12;
  EXPECT_THAT(find_board(image, wrong).rejected, HasSubstr("no board of 12 x 5 squares"));
  BoardOptions charuco{.kind = BoardKind::Charuco, .columns = 6, .rows = 5, .square = 0.06};
  EXPECT_THAT(find_board(image, charuco).rejected, HasSubstr("no marker of the dictionary"));
  const ByteImage large = seen(charuco, camera, before_camera(charuco, 0));
  charuco.columns = 4;
  charuco.rows = 3;
  EXPECT_THAT(find_board(large, charuco).rejected, HasSubstr("is on no board of 4 x 3 squares"));
  const BoardOptions marker{.kind = BoardKind::Marker, .marker_id = 999};
  EXPECT_THAT(find_board(large, marker).rejected, HasSubstr("with the number"));
  BoardOptions any = marker;
  any.marker_id = -1;
  EXPECT_THAT(find_board(large, any).rejected, HasSubstr("say which by its number"));
  EXPECT_NE(find_board(ByteImage(64, 64, 3, 90), chessboard).rejected, "");
}

TEST(FindBoard, BadBoardOrImage_IsRefused) {
  ATELIER_EXPECT_REFUSED(find_board(ByteImage(8, 8, 2), BoardOptions{}), LogicError,
                         "1 or 3 channels");
  BoardOptions board{.kind = BoardKind::Charuco};
  board.dictionary = "9x9_1";
  ATELIER_EXPECT_REFUSED(find_board(ByteImage(64, 64, 1), board), LogicError, "is called '9x9_1'");
  ATELIER_EXPECT_REFUSED(board_points({.columns = 2}), LogicError, "fewer than 3 x 3");
  ATELIER_EXPECT_REFUSED(board_points({.square = 0}), LogicError, "without size");
}

/// [fx fy cx cy d...] of an OpenCV yml, by the numbers after a key.
std::vector<double> numbers_after(const std::filesystem::path& file, const std::string& key) {
  std::ifstream stream(file);
  std::stringstream buffer;
  buffer << stream.rdbuf();
  const std::string text = buffer.str();
  const std::size_t data = text.find('[', text.find(key + ":"));
  std::string list = text.substr(data + 1, text.find(']', data) - data - 1);
  std::replace(list.begin(), list.end(), ',', ' ');
  std::stringstream values(list);
  std::vector<double> numbers;
  for (double value = 0; values >> value;) {
    numbers.push_back(value);
  }
  return numbers;
}

Camera shipped_lens(const std::filesystem::path& file, const std::string& matrix,
                    const std::string& distortion) {
  const std::vector<double> k = numbers_after(file, matrix);
  const std::vector<double> d = numbers_after(file, distortion);
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = k.at(0);
  camera.fy = k.at(4);
  camera.cx = k.at(2) + 0.5;
  camera.cy = k.at(5) + 0.5;
  camera.distortion_model = Distortion::Brown;
  std::copy(d.begin(), d.end(), camera.distortion.begin());
  return camera;
}

TEST(RealBoards, OpencvStereo_IsNoWorseThanShippedCalibration) {
  ATELIER_TEST_FILE(folder, "opencv_stereo_chessboard");
  const BoardOptions board{.columns = 10, .rows = 7, .square = 0.025};
  std::vector<BoardView> views;
  const char* names[] = {"left", "right"};
  for (int c = 0; c < 2; ++c) {
    for (int frame = 1; frame <= 14; ++frame) {
      char name[32];
      std::snprintf(name, sizeof name, "%s%02d.jpg", names[c], frame);
      if (!std::filesystem::exists(folder / name)) {
        continue;
      }
      FoundBoard found = find_board(read_byte_image(folder / name), board);
      if (found.rejected.empty()) {
        found.view.camera_idx = c;
        found.view.frame_id = frame;
        views.push_back(found.view);
      }
    }
  }
  EXPECT_GE(views.size(), 25U);
  std::vector<Camera> sizes(2);
  for (int c = 0; c < 2; ++c) {
    sizes[static_cast<std::size_t>(c)].id = names[c];
    sizes[static_cast<std::size_t>(c)].width = 640;
    sizes[static_cast<std::size_t>(c)].height = 480;
  }
  const Calibration both = calibrate(unknown_rig(sizes), views, board);
  std::printf("%s", calibration_text(both).c_str());
  EXPECT_TRUE(both.converged);
  for (int c = 0; c < 2; ++c) {
    std::vector<BoardView> own;
    for (BoardView view : views) {
      if (view.camera_idx == c) {
        view.camera_idx = 0;
        own.push_back(view);
      }
    }
    const Camera shipped =
        shipped_lens(folder / "intrinsics.yml", c == 0 ? "M1" : "M2", c == 0 ? "D1" : "D2");
    Camera ours = both.cameras[static_cast<std::size_t>(c)];
    ours.camera_from_world_rotation.setIdentity();
    ours.camera_from_world_translation.setZero();
    const double shipped_rms = root_mean_square(board_errors({shipped}, own, board));
    const double our_rms = root_mean_square(board_errors({ours}, own, board));
    std::printf("%s: shipped intrinsics.yml %.4f px rms, ours %.4f px rms, over %zu views\n",
                names[c], shipped_rms, our_rms, own.size());
    EXPECT_LE(our_rms, shipped_rms);
    if (c == 0) {
      const Camera alone =
          shipped_lens(folder / "left_intrinsics.yml", "camera_matrix", "distortion_coefficients");
      const Calibration left = calibrate(unknown_rig({sizes[0]}), own, board);
      Camera left_camera = left.cameras[0];
      left_camera.camera_from_world_rotation.setIdentity();
      left_camera.camera_from_world_translation.setZero();
      const double alone_rms = root_mean_square(board_errors({alone}, own, board));
      const double left_rms = root_mean_square(board_errors({left_camera}, own, board));
      std::printf(
          "left alone: shipped left_intrinsics.yml %.4f px rms (0.393 as it says itself), ours "
          "%.4f px rms\n",
          alone_rms, left_rms);
      EXPECT_LE(left_rms, alone_rms);
    }
  }
}

/// Errors of corners triangulated one by one, the measure that the shipped solution minimised.
std::vector<double> point_errors(const std::vector<Camera>& cameras,
                                 const std::vector<BoardView>& views) {
  struct Ray {
    std::size_t camera;
    Eigen::Vector2d pixel;
  };
  std::map<std::pair<int, int>, std::vector<Ray>> points;
  for (const BoardView& view : views) {
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      points[{view.frame_id, view.ids[i]}].push_back(
          {static_cast<std::size_t>(view.camera_idx),
           view.pixels.row(static_cast<Eigen::Index>(i)).transpose()});
    }
  }
  std::vector<double> errors;
  for (const auto& [key, rays] : points) {
    if (rays.size() < 2) {
      continue;
    }
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Ray& ray : rays) {
      const Eigen::Vector3d direction = *ray_direction(cameras[ray.camera], ray.pixel);
      const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - direction * direction.transpose();
      normal += off;
      right += off * camera_center(cameras[ray.camera]);
    }
    Eigen::Vector3d x = normal.ldlt().solve(right);
    for (int step = 0; step < 10; ++step) {
      Eigen::Matrix3d n = Eigen::Matrix3d::Zero();
      Eigen::Vector3d r = Eigen::Vector3d::Zero();
      for (const Ray& ray : rays) {
        const auto pixel = project(cameras[ray.camera], x);
        const auto j = project_jacobian(cameras[ray.camera], x);
        if (pixel && j) {
          n += j->transpose() * *j;
          r += j->transpose() * (*pixel - ray.pixel);
        }
      }
      x -= n.ldlt().solve(r);
    }
    for (const Ray& ray : rays) {
      const auto pixel = project(cameras[ray.camera], x);
      errors.push_back(pixel ? (*pixel - ray.pixel).norm() : 1e3);
    }
  }
  return errors;
}

TEST(RealBoards, CaliscopeCharuco_IsNoWorseThanShippedCalibration) {
  ATELIER_TEST_FILE(folder, "caliscope_calib/charuco_3to4cam_solved");
  const BoardOptions board{
      .kind = BoardKind::Charuco, .columns = 4, .rows = 5, .square = 0.054, .inverted = true};
  // The corners that the shipped solution was made from.
  std::ifstream csv(folder / "calibration/extrinsic/CHARUCO/xy_CHARUCO.csv");
  std::map<std::pair<int, int>, BoardView> by_view;
  std::string line;
  std::getline(csv, line);
  while (std::getline(csv, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::stringstream values(line);
    int frame = 0, camera = 0, object = 0, id = 0;
    double x = 0, y = 0;
    values >> frame >> camera >> object >> id >> x >> y;
    BoardView& view = by_view[{camera, frame}];
    view.camera_idx = camera;
    view.frame_id = frame;
    view.ids.push_back(id);
    view.pixels.conservativeResize(view.pixels.rows() + 1, 2);
    view.pixels.bottomRows(1) << x + 0.5, y + 0.5;
  }
  std::vector<BoardView> views;
  for (const auto& [key, view] : by_view) {
    if (view.ids.size() >= 4) {
      views.push_back(view);
    }
  }
  ASSERT_GT(views.size(), 100U);
  const std::vector<Camera> shipped = open_dataset(folder / "camera_array.toml").cameras;
  ASSERT_EQ(shipped.size(), 4U);
  std::vector<RigCamera> known;
  for (const Camera& camera : shipped) {
    known.push_back({camera, true});
    known.back().camera.camera_from_world_rotation.setIdentity();
    known.back().camera.camera_from_world_translation.setZero();
  }
  const Calibration with_lenses = calibrate(known, views, board);
  std::printf("shipped lenses, our poses: flat boards %.3f px rms, single points %.3f px rms\n",
              root_mean_square(board_errors(with_lenses.cameras, views, board)),
              root_mean_square(point_errors(with_lenses.cameras, views)));
  const Calibration found = calibrate(unknown_rig(shipped), views, board);
  std::printf("%s", calibration_text(found).c_str());
  ASSERT_TRUE(std::all_of(found.quality.begin(), found.quality.end(),
                          [](const CameraQuality& quality) { return quality.in_rig; }));
  const auto shipped_boards = board_errors(shipped, views, board);
  const auto our_boards = board_errors(found.cameras, views, board);
  std::printf("flat boards: shipped %.3f px rms (median %.3f, p95 %.3f), ours %.3f (%.3f, %.3f)\n",
              root_mean_square(shipped_boards), percentile(shipped_boards, 0.5),
              percentile(shipped_boards, 0.95), root_mean_square(our_boards),
              percentile(our_boards, 0.5), percentile(our_boards, 0.95));
  EXPECT_LE(root_mean_square(our_boards), root_mean_square(shipped_boards));
  const auto shipped_points = point_errors(shipped, views);
  const auto our_points = point_errors(found.cameras, views);
  std::printf(
      "single points: shipped %.3f px rms (median %.3f, p95 %.3f), ours %.3f (%.3f, %.3f)\n",
      root_mean_square(shipped_points), percentile(shipped_points, 0.5),
      percentile(shipped_points, 0.95), root_mean_square(our_points), percentile(our_points, 0.5),
      percentile(our_points, 0.95));
  EXPECT_LE(root_mean_square(our_points), root_mean_square(shipped_points));
  EXPECT_LE(percentile(our_points, 0.5), percentile(shipped_points, 0.5));
}

}  // namespace
}  // namespace atelier::fixtures
