#include "pipeline/preparation/prepare_recording.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string_view>
#include <system_error>

#include "capture/frame_reader.h"
#include "capture/input/board_pictures.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/child_program.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUsualBoards[] = {
    "calibration/intrinsics", "calibration", "intrinsics", "boards", "board", "chessboard",
    "checkerboard",           "charuco"};

constexpr const char* kMasks = "--masks";

/// Whether two cameras look at the person from directions that stereo can compare.
bool have_close_views(const std::vector<Camera>& cameras) {
  const double cosine = std::cos(40 * std::numbers::pi / 180);  // our choice
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (cameras[a].camera_from_world_rotation.row(2).dot(
              cameras[b].camera_from_world_rotation.row(2)) > cosine) {
        return true;
      }
    }
  }
  return false;
}

std::vector<std::string> words_in(const std::string& text) {
  std::vector<std::string> words;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    if (end > at) {
      words.push_back(text.substr(at, end - at));
    }
    at = end + 1;
  }
  return words;
}

/// What images of a board tell.
struct SeenBoard {
  std::vector<std::string> flags;  ///< that say which board it is; none where it is the usual one
  std::vector<double> shapes;      ///< width over height of the images of each camera
};

/// One camera of some images, and at most so many of them, spread evenly.
Dataset some_images(const Dataset& all, std::size_t camera, std::size_t count) {
  Dataset some = all;
  some.cameras = {all.cameras[camera]};
  some.frames = {all.frames[camera]};
  auto& images = some.frames[0].images;
  const std::size_t every = std::max<std::size_t>(1, images.size() / count);
  std::size_t number = 0;
  std::vector<int> others;
  for (const auto& [frame, place] : images) {
    if (number % every != 0 || number / every >= count) {
      others.push_back(frame);
    }
    ++number;
  }
  for (const int frame : others) {
    images.erase(frame);
  }
  return some;
}

/// Looks at one camera after the other until one shows a board: to tell which it is takes seconds
/// an image.
SeenBoard seen_board(const fs::path& boards) {
  constexpr std::size_t kLookedAt = 3;  // images of a camera
  const Dataset pictures = open_board_pictures(boards);
  FrameReader reader(pictures);
  SeenBoard seen;
  for (std::size_t c = 0; c < pictures.cameras.size(); ++c) {
    for (const auto& [frame, image] : pictures.frames[c].images) {
      const auto header = reader.image_header(static_cast<Index>(c), frame);
      if (header && header->height > 0) {
        seen.shapes.push_back(static_cast<double>(header->width) / header->height);
        break;
      }
    }
  }
  for (std::size_t c = 0; c < pictures.cameras.size(); ++c) {
    const BoardPictures found = find_boards(some_images(pictures, c, kLookedAt), {});
    if (!found.views.empty()) {
      return seen;
    }
    for (const Finding& finding : found.findings) {
      if (finding.code == "board-nearby") {
        seen.flags = words_in(finding.setting);
        return seen;
      }
    }
  }
  throw DataError(
      boards.string(), "", "no chessboard or ChArUco board in the images",
      "images of one; atelier calibrate IMAGES --out FOLDER says why each was left out");
}

/// Whether the recording's images have the shape of the board's.
bool same_shapes(const Dataset& recording, const SeenBoard& board) {
  constexpr double kSame = 1e-3;
  return std::all_of(
      recording.frames.begin(), recording.frames.end(), [&](const CameraFrames& camera) {
        const double shape =
            static_cast<double>(camera.image_width) / std::max(camera.image_height, 1);
        return std::any_of(board.shapes.begin(), board.shapes.end(),
                           [&](double one) { return std::abs(one - shape) < kSame * one; });
      });
}

/// A word as a shell takes it.
std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (std::isalnum(static_cast<unsigned char>(c)) != 0) ||
           std::string_view("-_./=,:+@").find(c) != std::string_view::npos;
  });
  if (plain) {
    return word;
  }
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return quoted + "'";
}

bool has_keypoints(const Dataset& recording) {
  return std::any_of(recording.frames.begin(), recording.frames.end(),
                     [](const CameraFrames& camera) { return !camera.keypoints.empty(); });
}

/// Where the cameras' images are: what the layout of images alone looks for.
fs::path image_folder(const Dataset& recording) {
  for (const char* name : {"images", "videos"}) {
    std::error_code none;
    if (fs::is_directory(recording.root / name, none)) {
      return recording.root / name;
    }
  }
  return recording.root;
}

}  // namespace

fs::path board_folder(const fs::path& recording, const RecordingArguments& arguments) {
  if (!arguments.boards.empty()) {
    return arguments.boards;
  }
  for (const char* name : kUsualBoards) {
    std::error_code none;
    if (fs::is_directory(recording / name, none)) {
      return recording / name;
    }
  }
  return {};
}

std::vector<PreparationStep> preparation_steps(const Dataset& recording, const fs::path& folder,
                                               const RecordingArguments& arguments) {
  const fs::path boards = board_folder(recording.root, arguments);
  ATELIER_CHECK(!boards.empty(), "a folder of images of a board");
  const auto place = [&](const char* name) { return (folder / name).string(); };
  const SeenBoard board = seen_board(boards);
  std::vector<PreparationStep> steps;
  PreparationStep lenses = {
      "lenses",
      {"calibrate", boards.string(), "--out", place("lenses"), "--calibration.poses=false"},
      {"lenses"},
      ""};
  lenses.words.insert(lenses.words.end(), board.flags.begin(), board.flags.end());
  steps.push_back(lenses);

  const bool detected = has_keypoints(recording);
  if (!detected) {
    steps.push_back({"keypoints",
                     {"detect", recording.root.string(), "--out", place("seen")},
                     {"seen/keypoints2d"},
                     ""});
  }
  const std::string seen = detected ? recording.root.string() : place("seen");
  PreparationStep rig = {
      "poses",
      {"calibrate", seen, "--by-keypoints", "--lenses", place("lenses/lenses.json"), "--out",
       place("rig"), "--person.stature", short_number(arguments.stature)},
      {"rig"},
      "images of one number are of one instant, and the person is " +
          short_number(arguments.stature) + " m tall (--stature)"};
  if (!same_shapes(recording, board)) {
    rig.words.insert(rig.words.end(), {"--lens-fit", "padded"});
    rig.assumed += "; images of another shape than the board's have bars on two sides";
  }
  steps.push_back(rig);

  steps.push_back({"capture",
                   {"convert-capture", recording.root.string(), place("capture"), "--cameras",
                    place("rig/cameras.json")},
                   {"capture"},
                   ""});
  if (!detected) {
    steps.push_back({"views",
                     {"detect", place("capture"), kMasks},
                     {"capture/keypoints2d", "capture/labels"},
                     "what the detector takes for the person is the person with all clothes"});
  }
  return steps;
}

bool prepare_recording(const Dataset& recording, const std::vector<PreparationStep>& steps,
                       const fs::path& folder,
                       const std::function<void(const std::string& line)>& say,
                       const std::function<bool()>& stop) {
  // The images beside the keypoints that are found in them, as one capture.
  make_private_directory(folder / "seen");
  const fs::path images = folder / "seen" / "videos";
  std::error_code error;
  fs::remove(images, error);
  fs::create_directory_symlink(fs::absolute(image_folder(recording)), images, error);
  if (error) {
    throw EnvironmentError(images.string(), error.message());
  }
  for (PreparationStep step : steps) {
    const fs::path done = folder / (step.name + ".done");
    if (fs::exists(done)) {
      continue;
    }
    if (step.words.back() == kMasks && !have_close_views(read_cameras(folder / "rig"))) {
      step.words.pop_back();
      step.assumed = "cameras this far apart make no surface, and keypoints need no masks";
    }
    for (const std::string& made : step.makes) {
      fs::remove_all(folder / made);
    }
    std::string command = "atelier";
    for (const std::string& word : step.words) {
      command += " " + shell_word(word);
    }
    say(step.name + (step.assumed.empty() ? "" : ", taking for granted that " + step.assumed) +
        ": " + command);
    if (!run_child_program(
            "atelier", step.words, "it belongs beside this program",
            [&](const std::string& line) { say("  " + line); }, stop)) {
      return false;
    }
    write_file_atomically(done, "");
  }
  return true;
}

}  // namespace atelier
