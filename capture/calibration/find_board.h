#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "capture/calibration/board.h"
#include "core/image.h"

namespace atelier {

/// One camera's detection of the board at one instant.
struct BoardView {
  int camera_idx = 0;
  int frame_id = 0;
  std::vector<int> ids;  ///< rows of board_points, increasing
  /// [N,2] pixels, first pixel's centre at (0.5, 0.5)
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> pixels;
};

/// The board in one image, or why it is not taken.
struct FoundBoard {
  BoardView view;
  std::string
      rejected;  ///< "" if it was found; else one clause: "no board", "3 markers alone", ...
};

/// Looks for the board (OpenCV: findChessboardCorners with cornerSubPix, then
/// findChessboardCornersSB; detectMarkers and interpolateCornersCharuco with cornerSubPix). A
/// chessboard is found whole or not at all, its first corner beside a dark inner square, so that
/// all cameras number alike.
/// @param image  sRGB bytes, 1 or 3 channels
FoundBoard find_board(const ByteImage& image, const BoardOptions& board);

/// Where nothing was found: a number of squares near the given one under which `image` shows a
/// chessboard, "10 x 7"; "" if there is none.
std::string nearby_board(const ByteImage& image, const BoardOptions& board);

}  // namespace atelier
