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
  std::vector<BoardView> views;
  std::vector<RejectedView> rejected;
  std::vector<Finding> findings;
};

CameraBoards boards_of(const Dataset& dataset, std::size_t c, const BoardOptions& board,
                       int every) {
  CameraBoards found;
  FrameReader reader(dataset);
  const std::string& id = dataset.cameras[c].id;
  std::vector<int> missed;
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
      missed.push_back(frame);
      continue;
    }
    one.view.camera_idx = static_cast<int>(c);
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
      const std::string size =
          nearby_board(*reader.byte_image(static_cast<Index>(c), missed[i]), board);
      if (!size.empty()) {
        found.findings.push_back(
            {Severity::Error, "board-nearby", id,
             "no board of " + std::to_string(board.columns) + " x " + std::to_string(board.rows) +
                 " squares, and one of " + size + " in frame " + std::to_string(missed[i]),
             "--board.columns and --board.rows count squares, not inner corners"});
        break;
      }
    }
  }
  return found;
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
    all.views.insert(all.views.end(), parts[c].views.begin(), parts[c].views.end());
    all.rejected.insert(all.rejected.end(), parts[c].rejected.begin(), parts[c].rejected.end());
    all.findings.insert(all.findings.end(), parts[c].findings.begin(), parts[c].findings.end());
  }
  return all;
}

std::vector<RigCamera> with_lenses(std::vector<RigCamera> rig, const Dataset& lenses) {
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
    const double scale = static_cast<double>(rig[c].camera.width) / known.width;
    if (rig[c].camera.width > 0 && std::abs(scale * known.height - rig[c].camera.height) > 0.01) {
      throw DataError(lenses.root.string(), "camera '" + wanted[c] + "'",
                      "a lens of " + std::to_string(known.width) + " x " +
                          std::to_string(known.height) + " pixels",
                      "one of the images' shape: " + std::to_string(rig[c].camera.width) + " x " +
                          std::to_string(rig[c].camera.height));
    }
    Camera camera = known;
    camera.id = wanted[c];
    camera.width = rig[c].camera.width;
    camera.height = rig[c].camera.height;
    camera.fx *= scale;
    camera.fy *= scale;
    camera.cx *= scale;
    camera.cy *= scale;
    camera.camera_from_world_rotation.setIdentity();
    camera.camera_from_world_translation.setZero();
    rig[c] = {camera, true};
  }
  return rig;
}

}  // namespace atelier
