#include "capture/layouts/images.h"

#include "capture/layouts/frame_files.h"
#include "core/error.h"
#include "core/io/ground_truth_archive.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

/// Where the cameras' folders, zips or videos are, and which have pictures.
struct Found {
  fs::path base;
  std::vector<std::string> names;
};

bool has_pictures(const fs::path& base, const std::string& name, const Limits& limits) {
  return !fs::is_directory(base / name) || !numbered_files(base / name, {}, limits).empty() ||
         !stamped_files(base / name, {}, limits).files.empty();
}

Found found_in(const fs::path& path, const Limits& limits) {
  for (const fs::path& base : {path / "images", path / "videos", path}) {
    Found found{base, {}};
    for (const std::string& name : camera_names(base, limits)) {
      if (has_pictures(base, name, limits)) {
        found.names.push_back(name);
      }
    }
    if (!found.names.empty()) {
      return found;
    }
  }
  return {};
}

}  // namespace

std::string recognize_images(const fs::path& path) {
  const Found found = found_in(path, Limits{});
  const std::size_t count = found.names.size();
  return count == 0   ? ""
         : count == 1 ? "1 camera with images"
                      : std::to_string(count) + " cameras with images";
}

Dataset read_images(const fs::path& path, const DatasetOptions& /*options*/, const Limits& limits) {
  const Found found = found_in(path, limits);
  if (found.names.empty()) {
    throw DataError(path.string(), "", "no images",
                    "a folder, zip or video for each camera, with frame numbers as names");
  }
  Dataset dataset;
  dataset.root = path;
  dataset.calibrated = false;
  dataset.keypoint_shift = 0.5;
  dataset.info.keypoint_schema.clear();
  for (const std::string& name : found.names) {
    Camera camera;
    camera.id = name;
    dataset.cameras.push_back(camera);
    dataset.frames.emplace_back();
  }
  dataset = with_pictures(std::move(dataset), &CameraFrames::images, found.base, limits);
  dataset = with_pictures(std::move(dataset), &CameraFrames::masks, path / "masks", limits);
  for (const char* base : {"keypoints2d", "pose", "openpose"}) {
    dataset = with_keypoints(std::move(dataset), path / base, limits);
  }
  const bool ours = fs::exists(path / "capture.toml");
  dataset.findings.push_back(
      {Severity::Warning, "not-calibrated", path.string(),
       ours ? "there is no cameras.json beside capture.toml: images alone are read, and of "
              "capture.toml the consent alone"
            : "there are images and no calibration",
       "atelier calibrate makes one"});
  return dataset;
}

std::vector<std::string> write_images(const LayoutSource& source, const fs::path& out) {
  for (std::size_t c = 0; c < source.cameras().size(); ++c) {
    const std::string& id = source.cameras()[c].id;
    for (const int frame : source.sequence.frame_ids) {
      const auto camera = static_cast<Index>(c);
      write_picture(source, camera, frame, out / "images" / id / frame_name(frame));
      write_mask(source, camera, frame, out / "masks" / id / (frame_name(frame) + ".png"));
      write_keypoints(source, camera, frame,
                      out / "keypoints2d" / id / (frame_name(frame) + ".json"), 0.5);
    }
  }
  return {"the calibration, frame rate and labels are left out"};
}

}  // namespace atelier
