#include "capture/calibration/board.h"

#include "core/error.h"

namespace atelier {

const std::vector<std::string>& marker_dictionaries() {
  static const std::vector<std::string> kNames = {
      "4x4_50",        "4x4_100",        "4x4_250",       "4x4_1000", "5x5_50",   "5x5_100",
      "5x5_250",       "5x5_1000",       "6x6_50",        "6x6_100",  "6x6_250",  "6x6_1000",
      "7x7_50",        "7x7_100",        "7x7_250",       "7x7_1000", "original", "apriltag_16h5",
      "apriltag_25h9", "apriltag_36h10", "apriltag_36h11"};
  return kNames;
}

OptionTable describe(BoardOptions& options) {
  OptionTable table;
  table.add(
      "kind", options.kind,
      {{"chessboard", BoardKind::Chessboard},
       {"charuco", BoardKind::Charuco},
       {"marker", BoardKind::Marker}},
      "Calibration pattern: a chessboard, one with ArUco markers (ChArUco), or a single marker");
  table.add("columns", options.columns, 3, 64, "",
            "Number of squares across, as printed: one more than there are inner corners");
  table.add("rows", options.rows, 3, 64, "", "Number of squares down, as printed");
  table.add("square", options.square, 1e-4, 100, "m",
            "Side of a square, or of the black square of a single marker; it determines the scale");
  table.add("marker", options.marker, 0.01, 0.999, "",
            "Side of a ChArUco marker as a fraction of the side of its square");
  table.add("dictionary", options.dictionary, marker_dictionaries(),
            "ArUco dictionary of the markers");
  table.add("marker_id", options.marker_id, -1, 10000, "",
            "Number of the single marker; -1: the one that is seen");
  table.add("inverted", options.inverted, "Board printed with black and white exchanged");
  return table;
}

BoardPoints board_points(const BoardOptions& board) {
  ATELIER_CHECK(board.square > 0, "a board without size");
  BoardPoints points;
  if (board.kind == BoardKind::Marker) {
    const double half = board.square / 2;
    points.resize(4, 2);
    points << -half, -half, half, -half, half, half, -half, half;
    return points;
  }
  ATELIER_CHECK(board.columns >= 3 && board.rows >= 3, "a board of fewer than 3 x 3 squares");
  points.resize((board.columns - 1) * (board.rows - 1), 2);
  for (int row = 1, i = 0; row < board.rows; ++row) {
    for (int column = 1; column < board.columns; ++column, ++i) {
      points.row(i) << column * board.square, row * board.square;
    }
  }
  return points;
}

bool is_symmetric(const BoardOptions& board) {
  return board.kind == BoardKind::Chessboard && (board.columns + board.rows) % 2 == 0;
}

}  // namespace atelier
