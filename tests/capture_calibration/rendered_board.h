#pragma once

#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "capture/calibration/board.h"
#include "capture/calibration/lens.h"
#include "core/camera.h"
#include "core/image.h"

namespace atelier::fixtures {

/// A board that is printed: what is white of its plane, by arithmetic of its own.
class PrintedBoard {
 public:
  /// @param legacy  of ChArUco: the upper left square is white
  explicit PrintedBoard(const BoardOptions& board, bool legacy = false,
                        int dictionary = cv::aruco::DICT_4X4_1000)
      : board_(board), legacy_(legacy) {
    const auto markers = cv::aruco::getPredefinedDictionary(dictionary);
    cells_ = markers->markerSize + 2;
    for (int id = 0; id < board.columns * board.rows / 2 && board.kind == BoardKind::Charuco;
         ++id) {
      cv::Mat marker;
      cv::aruco::drawMarker(markers, id, cells_, marker, 1);
      markers_.push_back(marker);
    }
    int next = 0;
    for (int row = 0; row < board.rows; ++row) {
      for (int column = 0; column < board.columns; ++column) {
        number_.push_back(is_white(column, row) ? next++ : -1);
      }
    }
  }

  /// Brightness, 0 to 255, of a place in the plane, m; 110 beyond the board and its white border.
  double at(double x, double y) const {
    x /= board_.square;
    y /= board_.square;
    const int column = static_cast<int>(std::floor(x));
    const int row = static_cast<int>(std::floor(y));
    if (x < -1 || y < -1 || x > board_.columns + 1 || y > board_.rows + 1) {
      return 110;
    }
    if (column < 0 || row < 0 || column >= board_.columns || row >= board_.rows) {
      return kWhite;
    }
    const int id = number_[static_cast<std::size_t>(row * board_.columns + column)];
    if (id < 0) {
      return kBlack;
    }
    const double gap = 0.5 * (1 - board_.marker);
    const double u = (x - column - gap) / board_.marker;
    const double v = (y - row - gap) / board_.marker;
    if (id >= static_cast<int>(markers_.size()) || u < 0 || v < 0 || u >= 1 || v >= 1) {
      return kWhite;
    }
    const bool light = markers_[static_cast<std::size_t>(id)].at<std::uint8_t>(
                           static_cast<int>(v * cells_), static_cast<int>(u * cells_)) > 0;
    return light ? kWhite : kBlack;
  }

 private:
  static constexpr double kBlack = 25;
  static constexpr double kWhite = 225;
  bool is_white(int column, int row) const { return (column + row) % 2 == (legacy_ ? 0 : 1); }
  BoardOptions board_;
  bool legacy_;
  int cells_ = 0;
  std::vector<cv::Mat> markers_;
  std::vector<int> number_;  ///< of the marker in each square; -1: black
};

/// A disc of the image that something hides.
struct Hidden {
  Eigen::Vector2d middle = {0, 0};  ///< px
  double radius = 0;                ///< px
};

/// The board as a camera sees it, by the rays of its pixels: the mean of 4 x 4 places of each.
inline ByteImage rendered(const PrintedBoard& board, const Camera& camera,
                          const RigidNumbers& world_from_board, const Hidden& hidden = {}) {
  // Rays on a grid and straight between: off by less than 0.005 px.
  constexpr int kStep = 4;
  const int across = camera.width / kStep + 2;
  const int down = camera.height / kStep + 2;
  const Eigen::Matrix3d rotation = rotation_of(world_from_board).transpose();
  const Eigen::Vector3d eye = rotation * (camera_center(camera) - world_from_board.tail<3>());
  std::vector<Eigen::Vector3d> rays(static_cast<std::size_t>(across * down),
                                    Eigen::Vector3d::Zero());
  for (int y = 0; y < down; ++y) {
    for (int x = 0; x < across; ++x) {
      if (const auto ray = ray_direction(camera, Eigen::Vector2d(kStep * x, kStep * y))) {
        rays[static_cast<std::size_t>(y * across + x)] = rotation * *ray;
      }
    }
  }
  ByteImage image(camera.width, camera.height, 1);
  constexpr int kSub = 4;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int k = 0; k < kSub * kSub; ++k) {
        const Eigen::Vector2d pixel(x + (k % kSub + 0.5) / kSub, y + (k / kSub + 0.5) / kSub);
        if ((pixel - hidden.middle).norm() < hidden.radius) {
          sum += 110;
          continue;
        }
        const int gx = static_cast<int>(pixel.x() / kStep);
        const int gy = static_cast<int>(pixel.y() / kStep);
        const double u = pixel.x() / kStep - gx;
        const double v = pixel.y() / kStep - gy;
        const auto ray = [&](int i, int j) {
          return rays[static_cast<std::size_t>((gy + j) * across + gx + i)];
        };
        const Eigen::Vector3d direction = (1 - v) * ((1 - u) * ray(0, 0) + u * ray(1, 0)) +
                                          v * ((1 - u) * ray(0, 1) + u * ray(1, 1));
        const double t = -eye.z() / direction.z();
        sum += t > 0 ? board.at(eye.x() + t * direction.x(), eye.y() + t * direction.y()) : 110;
      }
      image.data[static_cast<std::size_t>(y * camera.width + x)] =
          static_cast<std::uint8_t>(std::lround(sum / (kSub * kSub)));
    }
  }
  return image;
}

}  // namespace atelier::fixtures
