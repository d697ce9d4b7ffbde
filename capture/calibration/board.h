#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/options.h"

namespace atelier {

/// The calibration target.
enum class BoardKind {
  Chessboard,
  Charuco,  ///< a chessboard with ArUco markers in its white squares (Garrido-Jurado 2014)
  Marker,   ///< one ArUco marker
};

struct BoardOptions {
  BoardKind kind = BoardKind::Chessboard;
  int columns = 10;      ///< squares across, as printed, 3 to 64 (9 inner corners: 10)
  int rows = 7;          ///< squares down, 3 to 64
  double square = 0.03;  ///< m: side of a square, or of the black square of a single marker
  double marker = 0.75;  ///< of ChArUco: side of a marker as a share of its square, (0, 1)
  std::string dictionary = "4x4_1000";  ///< of the markers
  int marker_id = -1;                   ///< of a single marker; -1: whichever is seen
  bool inverted = false;                ///< white is printed black
};
OptionTable describe(BoardOptions& options);

/// Names of ArUco's dictionaries: "4x4_50", ... "7x7_1000", "original", "apriltag_36h11".
const std::vector<std::string>& marker_dictionaries();

/// Corners in the plane of a board, m, [N,2].
using BoardPoints = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

/// Detected points of a board: metres in its own plane, x across, y down as printed, z = 0; [N,2].
/// Inner corners of a chessboard row by row; the four corners of a marker, clockwise, from its
/// middle. Throws LogicError for options out of range.
BoardPoints board_points(const BoardOptions& board);

/// True for a chessboard that looks the same upside down: cameras then cannot agree on which
/// corner is the first. Boards whose numbers of squares are one odd and one even are not.
bool is_symmetric(const BoardOptions& board);

}  // namespace atelier
