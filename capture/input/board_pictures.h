#pragma once

#include <filesystem>
#include <vector>

#include "capture/calibration/calibrate.h"
#include "capture/dataset.h"

namespace atelier {

/// Images of a board: a folder, zip or video for each camera, or one folder of images whose
/// names differ between cameras in more than the last number (left01.jpg, right01.jpg). Images
/// with the same number are of one instant. Throws DataError where there are none.
Dataset open_board_pictures(const std::filesystem::path& path);

/// Result of the detection.
struct BoardPictures {
  std::vector<RigCamera> rig;  ///< ids and sizes
  std::vector<BoardView> views;
  std::vector<RejectedView> rejected;
  std::vector<Finding> findings;  ///< "board-nearby", "picture-sizes"
};

/// Looks for the board in every `every`-th frame of every camera. Images that cannot be read, or
/// are of another size than their camera's first, are rejected with the reason. Where a camera's
/// images show no chessboard, a finding names the size that one of them does show.
BoardPictures find_boards(const Dataset& dataset, const BoardOptions& board, int every = 1);

/// Gives the cameras of `rig` the lenses of a capture or calibration file, by name; an image size
/// that is an exact scale scales them. Throws DataError for a camera that it does not have.
std::vector<RigCamera> with_lenses(std::vector<RigCamera> rig, const Dataset& lenses);

}  // namespace atelier
