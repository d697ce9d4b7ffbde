#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/dataset.h"

namespace atelier {

/// Inputs of a recording without calibration, beside its images.
struct RecordingArguments {
  std::string boards;     ///< folder of images of a board; "": a usual one of the recording's
  double stature = 1.75;  ///< m, of the person: it sets the scale
};

/// The folder of images of a board: the one that was named, else calibration/intrinsics,
/// calibration, intrinsics, boards, board, chessboard, checkerboard or charuco in the recording; ""
/// if there is none.
std::filesystem::path board_folder(const std::filesystem::path& recording,
                                   const RecordingArguments& arguments);

/// One command of this program, and what it makes.
struct PreparationStep {
  std::string name;                ///< of the step, and of the file that says that it was done
  std::vector<std::string> words;  ///< behind the program's name
  std::vector<std::string> makes;  ///< in the folder; removed where an earlier try did not end
  std::string assumed;             ///< what it takes for granted; "" if nothing
};

/// What makes a native capture, FOLDER/capture, of a recording that has images of several cameras
/// and no calibration: lenses by images of a board (`calibrate`), keypoints by the built-in
/// detector
/// (`detect`) unless there are some, poses by the keypoints (`calibrate --by-keypoints`), the
/// capture
/// (`convert-capture`), and keypoints on which the views agree with masks (`detect --masks`). Looks
/// at images of the board to tell which one it is. Throws DataError where none shows one.
/// @param folder  for the capture and what leads to it, such as WORKSPACE.recording
std::vector<PreparationStep> preparation_steps(const Dataset& recording,
                                               const std::filesystem::path& folder,
                                               const RecordingArguments& arguments);

/// Does the steps that were not done before, one after the other; masks where cameras are close
/// enough for stereo to make a surface of them. Returns false if it was stopped.
/// Throws the errors of the commands, DataError or EnvironmentError.
/// @param say   is told what is done, a line each
/// @param stop  asked now and then
bool prepare_recording(const Dataset& recording, const std::vector<PreparationStep>& steps,
                       const std::filesystem::path& folder,
                       const std::function<void(const std::string& line)>& say,
                       const std::function<bool()>& stop);

}  // namespace atelier
