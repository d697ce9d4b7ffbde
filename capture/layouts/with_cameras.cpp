#include "capture/layouts/with_cameras.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "capture/layouts/frame_files.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/file_bytes.h"
#include "core/limits.h"

namespace atelier {

Dataset with_cameras(Dataset dataset, const std::string& file) {
  const std::vector<Camera> cameras =
      parse_cameras_json(read_file_text(file, Limits{}.text_file_bytes), file);
  std::vector<std::string> there;
  std::vector<std::string> wanted;
  there.reserve(cameras.size());
  wanted.reserve(dataset.cameras.size());
  for (const Camera& camera : cameras) {
    there.push_back(camera.id);
  }
  for (const Camera& camera : dataset.cameras) {
    wanted.push_back(camera.id);
  }
  const MatchedNames matched = matched_names(wanted, there);
  Dataset result = dataset;
  result.cameras.clear();
  result.frames.clear();
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const Camera& camera) {
      return camera.id == matched.names[c];
    });
    const CameraFrames& frames = dataset.frames[c];
    if (found == cameras.end()) {
      result.findings.push_back({Severity::Warning, "camera-left-out", dataset.cameras[c].id,
                                 "the calibration does not have it", "calibrate it too"});
      continue;
    }
    if (frames.image_width > 0 &&
        (frames.image_width != found->width || frames.image_height != found->height)) {
      throw DataError(
          file, "camera '" + found->id + "'",
          std::to_string(found->width) + " x " + std::to_string(found->height) + " pixels",
          "the images' " + std::to_string(frames.image_width) + " x " +
              std::to_string(frames.image_height));
    }
    result.cameras.push_back(*found);
    result.cameras.back().id = dataset.cameras[c].id;
    result.frames.push_back(frames);
  }
  if (result.cameras.empty()) {
    throw DataError(file, "", "no camera of the capture", "those that it has images of");
  }
  std::erase_if(result.findings,
                [](const Finding& finding) { return finding.code == "not-calibrated"; });
  result.calibrated = true;
  return result;
}

}  // namespace atelier
