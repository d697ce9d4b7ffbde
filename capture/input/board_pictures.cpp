#include "capture/input/board_pictures.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "capture/frame_reader.h"
#include "capture/layouts/frame_files.h"
#include "capture/layouts/images.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/posed_images.h"
#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

Dataset of_one_folder(const fs::path& path) {
  if (!fs::is_directory(path)) {
    throw DataError(path.string(), "", fs::exists(path) ? "no folder" : "nothing is there",
                    "a folder with images of a board");
  }
  std::vector<PosedImage> images;
  for (const char* extension : {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}) {
    for (const fs::path& file : files_ending(path, extension)) {
      if (frame_number(file.filename().string())) {
        images.push_back({file.filename().string(), {}, {file, "", -1}, {}});
      }
    }
  }
  if (images.empty()) {
    throw DataError(path.string(), "", "no images of a board",
                    "a folder, zip or video for each camera, or images like left01.jpg");
  }
  Dataset dataset = dataset_of(images, path.string());
  dataset.calibrated = false;
  return dataset;
}

/// One camera's part of BoardPictures.
struct CameraBoards {
  int width = 0;
  int height = 0;
  int legacy = 0;  ///< views in the legacy pattern
  std::vector<BoardView> views;
  std::vector<RejectedView> rejected;
  std::vector<Finding> findings;
};

/// Of images that EXIF says to show turned: the calibration is of the stored ones.
void note_orientation(const std::string& camera, int orientation, std::vector<Finding>& findings) {
  if (orientation != 1) {
    findings.push_back(
        {Severity::Note, "image-orientation", camera,
         "the EXIF of its images (orientation " + std::to_string(orientation) +
             ") says to show them turned or mirrored; the calibration is of the images as they are "
             "stored",
         "calibrate images and videos that another program has turned by images of the board that "
         "it has turned as well"});
  }
}

CameraBoards boards_of(const Dataset& dataset, std::size_t c, const BoardOptions& board,
                       int every) {
  CameraBoards found;
  FrameReader reader(dataset);
  const std::string& id = dataset.cameras[c].id;
  std::vector<RejectedView> missed;  ///< the board is not in them
  int other_sizes = 0;
  int number = 0;
  for (const auto& [frame, place] : dataset.frames[c].images) {
    if (number++ % every != 0) {
      continue;
    }
    std::optional<ByteImage> image;
    try {
      image = reader.byte_image(static_cast<Index>(c), frame);
    } catch (const DataError& error) {
      found.rejected.push_back({id, frame, std::string("it cannot be read: ") + error.what()});
      continue;
    }
    if (!image) {
      continue;
    }
    if (found.width == 0) {
      found.width = image->width;
      found.height = image->height;
      note_orientation(id, reader.image_header(static_cast<Index>(c), frame)->orientation,
                       found.findings);
    }
    if (image->width != found.width || image->height != found.height) {
      found.rejected.push_back({id, frame,
                                std::to_string(image->width) + " x " +
                                    std::to_string(image->height) + " pixels, and the first had " +
                                    std::to_string(found.width) + " x " +
                                    std::to_string(found.height)});
      ++other_sizes;
      continue;
    }
    FoundBoard one = find_board(*image, board);
    if (!one.rejected.empty()) {
      found.rejected.push_back({id, frame, one.rejected});
      missed.push_back(found.rejected.back());
      continue;
    }
    one.view.camera_idx = static_cast<int>(c);
    found.legacy += one.legacy ? 1 : 0;
    one.view.frame_id = frame;
    found.views.push_back(std::move(one.view));
  }
  if (other_sizes > 0) {
    found.findings.push_back({Severity::Warning, "picture-sizes", id,
                              std::to_string(other_sizes) + " images have another size",
                              "calibrate images of one size, that of the capture"});
  }
  if (found.views.empty()) {
    constexpr std::size_t kTried = 3;
    for (std::size_t i = 0; i < std::min(kTried, missed.size()); ++i) {
      const int frame = missed[i].frame_id;
      const auto nearby = nearby_board(*reader.byte_image(static_cast<Index>(c), frame), board);
      if (nearby) {
        found.findings.push_back(
            {Severity::Warning, "board-nearby", id,
             missed[i].why + ", and " + nearby->what + " in frame " + std::to_string(frame),
             nearby->advice, nearby->setting});
        break;
      }
    }
  }
  return found;
}

/// Says that a ChArUco board is of the legacy pattern.
void note_pattern(BoardPictures& pictures) {
  if (pictures.legacy == 0) {
    return;
  }
  const int all = static_cast<int>(pictures.views.size());
  const bool every = pictures.legacy == all;
  pictures.findings.push_back(
      {every ? Severity::Note : Severity::Warning, "board-pattern", "",
       "the ChArUco board has OpenCV's legacy pattern, its upper left square white, in " +
           (every ? "every view"
                  : std::to_string(pictures.legacy) + " of " + std::to_string(all) + " views"),
       every ? "nothing: it was printed by OpenCV before 4.6, by calib.io or with "
               "setLegacyPattern, and is read as such"
             : "calibrate by images of one board"});
}

/// The lens for images of this size.
Camera fitted_lens(Camera camera, int width, int height, LensFit fit) {
  double across = static_cast<double>(width) / camera.width;
  double down = static_cast<double>(height) / camera.height;
  if (fit == LensFit::Cropped) {
    across = down = std::max(across, down);
  } else if (fit == LensFit::Padded) {
    across = down = std::min(across, down);
  } else if (fit == LensFit::Exact) {
    down = across;  // the same but for rounding
  }
  camera.fx *= across;
  camera.fy *= down;
  camera.cx = across * camera.cx + 0.5 * (width - across * camera.width);
  camera.cy = down * camera.cy + 0.5 * (height - down * camera.height);
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace

Dataset open_board_pictures(const fs::path& path) {
  if (!recognize_images(path).empty()) {
    DatasetOptions options;
    options.layout = "images";
    return open_dataset(path, options);
  }
  return of_one_folder(path);
}

BoardPictures find_boards(const Dataset& dataset, const BoardOptions& board, int every) {
  std::vector<CameraBoards> parts(dataset.cameras.size());
  parallel_for(static_cast<Index>(parts.size()), 1, [&](Index begin, Index end) {
    for (Index c = begin; c < end; ++c) {
      parts[static_cast<std::size_t>(c)] =
          boards_of(dataset, static_cast<std::size_t>(c), board, every);
    }
  });
  BoardPictures all;
  for (std::size_t c = 0; c < parts.size(); ++c) {
    RigCamera camera;
    camera.camera.id = dataset.cameras[c].id;
    camera.camera.width = parts[c].width;
    camera.camera.height = parts[c].height;
    all.rig.push_back(camera);
    all.legacy += parts[c].legacy;
    all.views.insert(all.views.end(), parts[c].views.begin(), parts[c].views.end());
    all.rejected.insert(all.rejected.end(), parts[c].rejected.begin(), parts[c].rejected.end());
    all.findings.insert(all.findings.end(), parts[c].findings.begin(), parts[c].findings.end());
  }
  note_pattern(all);
  return all;
}

std::vector<RigCamera> with_lenses(std::vector<RigCamera> rig, const Dataset& lenses, LensFit fit) {
  std::vector<std::string> wanted;
  wanted.reserve(rig.size());
  for (const RigCamera& camera : rig) {
    wanted.push_back(camera.camera.id);
  }
  std::vector<std::string> there;
  there.reserve(lenses.cameras.size());
  for (const Camera& camera : lenses.cameras) {
    there.push_back(camera.id);
  }
  const MatchedNames matched = matched_names(wanted, there);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const Index at = camera_index(lenses, matched.names[c]);
    if (at < 0 || !lenses.calibrated) {
      throw DataError(lenses.root.string(), "camera '" + wanted[c] + "'", "no lens of it",
                      "a calibration of every camera");
    }
    const Camera& known = lenses.cameras[static_cast<std::size_t>(at)];
    const int width = rig[c].camera.width;
    const int height = rig[c].camera.height;
    const double scale = static_cast<double>(width) / known.width;
    if (width > 0 && std::abs(scale * known.height - height) > 0.01 && fit == LensFit::Exact) {
      throw DataError(lenses.root.string(), "camera '" + wanted[c] + "'",
                      "a lens of " + std::to_string(known.width) + " x " +
                          std::to_string(known.height) + " pixels",
                      "one of the images' shape, " + std::to_string(width) + " x " +
                          std::to_string(height) + ", or --lens-fit cropped, padded or stretched");
    }
    Camera camera = width > 0 ? fitted_lens(known, width, height, fit) : known;
    camera.id = wanted[c];
    camera.camera_from_world_rotation.setIdentity();
    camera.camera_from_world_translation.setZero();
    rig[c] = {camera, true};
  }
  return rig;
}

}  // namespace atelier
