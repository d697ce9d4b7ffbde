#pragma once

#include <Eigen/Core>
#include <optional>
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
      rejected;         ///< "" if it was found; else one clause: "no board", "3 markers alone", ...
  bool legacy = false;  ///< of ChArUco: the upper left square is white (charuco.h)
};

/// OpenCV's two detectors of chessboards: findChessboardCorners with cornerSubPix, and
/// findChessboardCornersSB (Duda and Frese 2018). Either: the first, then the second.
enum class ChessboardDetector { Either, Quads, Sectors };

/// Looks for the board. A chessboard is found whole or not at all, its first corner beside a dark
/// inner square, so that all cameras and both detectors number alike. Of a ChArUco board the
/// corners between two markers that were seen are found, by today's pattern or the legacy one,
/// whichever the markers lie in, and refined by cornerSubPix within the markers (OpenCV 4.6's own
/// interpolateCornersCharuco is half a pixel off, and knows today's pattern alone). One marker:
/// detectMarkers with cornerSubPix.
/// @param image  sRGB bytes, 1 or 3 channels
FoundBoard find_board(const ByteImage& image, const BoardOptions& board,
                      ChessboardDetector detector = ChessboardDetector::Either);

/// A board that an image shows instead of the one that was looked for.
struct NearbyBoard {
  std::string what;     ///< "a chessboard of 10 x 7 squares"
  std::string advice;   ///< one clause
  std::string setting;  ///< "--board.columns 10 --board.rows 7"
};

/// Where nothing was found: a chessboard of nearly as many squares, or a ChArUco board of any
/// dictionary and number of squares across, with black and white exchanged or not. Nothing where
/// there is none, and of a single marker. Some seconds.
std::optional<NearbyBoard> nearby_board(const ByteImage& image, const BoardOptions& board);

}  // namespace atelier
