#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "capture/layouts/colmap.h"
#include "capture/layouts/colmap_dense.h"
#include "capture/layouts/layout_table.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/opencv_yaml.h"
#include "capture/layouts/qualisys.h"
#include "capture/video_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/lower_extension.h"
#include "core/limits.h"
#include "core/saturating_cast.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {
namespace {

/// Files of captures are told apart by their place in a folder, not by what they begin with.
[[noreturn]] void name_the_folder(const std::filesystem::path& path) {
  const std::string scene = lower_extension(path) == ".txt" ? "" : "the .gltf that names it, or ";
  throw DataError(path.string(), "", "no file that says by itself what it is",
                  scene + "the capture's folder (also atelier validate FOLDER)");
}

void add_cameras(const std::map<std::uint32_t, Camera>& cameras, Inspection& inspection) {
  inspection.add("kind", "cameras, COLMAP");
  inspection.add("cameras", cameras.size());
  for (const auto& [id, camera] : cameras) {
    inspection.add_member("camera " + std::to_string(id),
                          {{"width", camera.width}, {"height", camera.height}});
  }
}

void add_pictures(const std::vector<ColmapImage>& pictures, Inspection& inspection) {
  inspection.add("kind", "images and where they were taken, COLMAP");
  inspection.add("pictures", pictures.size());
}

}  // namespace

void inspect_video(const std::filesystem::path& path, Inspection& inspection) {
  VideoFile video(path);
  inspection.add("kind", "video");
  inspection.add("width", video.width(), "px");
  inspection.add("height", video.height(), "px");
  inspection.add("frames", video.frames());
  inspection.add("fps", video.fps(), "1/s");
  if (const std::optional<VideoTimes>& times = video.times()) {
    inspection.add("first image at", video_pace(*times).start, "s");
    inspection.add("images that are not shown", times->hidden);
    inspection.findings = video_findings(*times, path.string());
  }
  // To come to a frame all before it are decoded. Our choice: some 1000 frames of 1920 x 1080,
  // which take seconds.
  constexpr double kMaxPixels = 2e9;
  const double most = kMaxPixels / (static_cast<double>(video.width()) * video.height());
  const int decoded =
      saturating_cast<int>(std::clamp(most, 1.0, static_cast<double>(video.frames())));
  for (const int frame : std::set<int>{0, decoded / 2, decoded - 1}) {
    video.frame(frame);
  }
  if (decoded < video.frames()) {
    inspection.findings.push_back(
        {Severity::Note, "video-not-decoded", "frame " + std::to_string(decoded),
         "images from here on are not looked at", "a player or ffmpeg decodes them all"});
  }
}

void inspect_yaml(const std::filesystem::path& path, Inspection& inspection) {
  const OpencvYaml yaml =
      parse_opencv_yaml(read_file_text(path, Limits{}.text_file_bytes), path.string());
  inspection.add("kind", "matrices and values, OpenCV's YAML");
  inspection.add("matrices", yaml.matrices.size());
  for (const auto& [name, matrix] : yaml.matrices) {
    inspection.add_member(
        name, {{"type", "float64"}, {"shape", std::vector<Index>{matrix.rows(), matrix.cols()}}});
  }
  for (const auto& [name, value] : yaml.scalars) {
    inspection.add_member(name, value.substr(0, 80));
  }
  for (const auto& [name, list] : yaml.lists) {
    inspection.add_member(name, {{"entries", list.size()}});
  }
}

void inspect_colmap_text(const std::filesystem::path& path, Inspection& inspection) {
  if (path.filename().string().ends_with(".qca.txt")) {
    const std::vector<Camera> cameras =
        parse_qualisys(read_file_text(path, Limits{}.text_file_bytes), path.string()).cameras;
    inspection.add("kind", "cameras, Qualisys");
    inspection.add("cameras", cameras.size());
  } else if (path.filename() == "cameras.txt") {
    add_cameras(
        parse_colmap_cameras_text(read_file_text(path, Limits{}.text_file_bytes), path.string()),
        inspection);
  } else if (path.filename() == "images.txt") {
    add_pictures(
        parse_colmap_images_text(read_file_text(path, Limits{}.text_file_bytes), path.string()),
        inspection);
  } else {
    name_the_folder(path);
  }
}

void inspect_colmap_binary(const std::filesystem::path& path, Inspection& inspection) {
  const std::vector<std::byte> bytes = read_file_bytes(path, Limits{}.motion_file_bytes);
  if (path.filename() == "cameras.bin") {
    add_cameras(parse_colmap_cameras_binary(bytes, path.string()), inspection);
  } else if (path.filename() == "images.bin") {
    add_pictures(parse_colmap_images_binary(bytes, path.string()), inspection);
  } else if (path.string().ends_with(".geometric.bin") ||
             path.string().ends_with(".photometric.bin")) {
    const Image matrix = parse_colmap_matrix(bytes, path.string());
    inspection.add("kind", "depth, normals or confidence of an image, COLMAP's matrix");
    inspection.add("width", matrix.width, "px");
    inspection.add("height", matrix.height, "px");
    inspection.add("channels", matrix.channels);
  } else {
    name_the_folder(path);
  }
}

bool inspect_capture_folder(const std::filesystem::path& path, Inspection& inspection,
                            Evidence evidence) {
  for (const Layout& layout : all_layouts()) {
    const bool pictures_alone = std::string_view(layout.name) == "images";
    if ((pictures_alone && evidence == Evidence::MoreThanPictures) ||
        layout.recognize(path).empty()) {
      continue;
    }
    const Dataset dataset = open_dataset(path);
    inspection.add("kind", "capture, layout '" + dataset.layout + "'");
    inspection.add("told by", dataset.evidence);
    inspection.add("cameras", dataset.cameras.size());
    inspection.add("calibrated", dataset.calibrated);
    for (const CaptureSequence& sequence : dataset.info.sequences) {
      inspection.add_member("sequence " + sequence.name,
                            {{"frames", sequence.frame_ids.size()}, {"fps", sequence.fps}});
    }
    inspection.findings = dataset.findings;
    if (dataset.layout == "native" &&
        std::all_of(dataset.frames.begin(), dataset.frames.end(),
                    [](const CameraFrames& frames) { return frames.images.empty(); })) {
      inspection.findings.push_back({Severity::Warning, "images-missing",
                                     (path / "images").string(), "no camera has an image",
                                     "most stages need them: images/<camera>/<frame>"});
    }
    add_stated_consent(dataset.info.consent, path, inspection);
    return true;
  }
  return false;
}

}  // namespace atelier
