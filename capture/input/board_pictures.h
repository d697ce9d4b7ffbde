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
  int legacy = 0;  ///< views of a ChArUco board in the legacy pattern
  /// "board-nearby", "board-pattern", "image-orientation", "picture-sizes"
  std::vector<Finding> findings;
};

/// Looks for the board in every `every`-th frame of every camera. Images that cannot be read, or
/// are of another size than their camera's first, are rejected with the reason. Where a camera's
/// images show no such board, a finding names one that they do show (nearby_board), and one says
/// that a ChArUco board has the legacy pattern.
BoardPictures find_boards(const Dataset& dataset, const BoardOptions& board, int every = 1);

/// Relation of images to a calibrated size of another aspect ratio.
enum class LensFit {
  Exact,      ///< unknown: such images are refused
  Cropped,    ///< scaled to fill the size, the excess cut off evenly on both sides
  Padded,     ///< scaled to fit, with bars on both sides
  Stretched,  ///< scaled differently across and down
};

/// Gives the cameras of `rig` the lenses of a capture or calibration file, by name, scaled to the
/// images. Throws DataError for a camera that it does not have, and for a size of
/// another aspect ratio under LensFit::Exact.
std::vector<RigCamera> with_lenses(std::vector<RigCamera> rig, const Dataset& lenses,
                                   LensFit fit = LensFit::Exact);

}  // namespace atelier
