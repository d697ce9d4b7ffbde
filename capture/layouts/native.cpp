#include "capture/layouts/native.h"

#include "capture/label_taxonomy.h"
#include "capture/layouts/frame_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"

namespace atelier {
namespace fs = std::filesystem;
namespace {

/// JPEG if every image is one, so that the bytes stay; else PNG.
std::string image_format_of(const LayoutSource& source) {
  bool any = false;
  for (std::size_t c = 0; c < source.cameras().size(); ++c) {
    for (const auto& [frame, place] : source.dataset().frames[c].images) {
      const std::optional<ImageHeader> header =
          place.member.empty() && place.index >= 0
              ? std::nullopt
              : source.frames().image_header(static_cast<Index>(c), frame);
      if (!header || header->format != ImageFormat::Jpeg) {
        return "png";
      }
      any = true;
    }
  }
  return any ? "jpg" : "png";
}

}  // namespace

std::string recognize_native(const fs::path& path) {
  return fs::exists(path / "capture.toml") && fs::exists(path / "cameras.json")
             ? "capture.toml and cameras.json"
             : "";
}

Dataset read_native(const fs::path& path, const DatasetOptions& /*options*/, const Limits& limits) {
  Dataset dataset;
  dataset.root = path;
  dataset.info = read_capture_info(path, limits);
  dataset.cameras = read_cameras(path, limits);
  dataset.frames.resize(dataset.cameras.size());
  dataset.world_convention = {1, "y"};
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const std::string& id = dataset.cameras[c].id;
    dataset.frames[c].images = numbered_files(path / "images" / id, {}, limits);
    dataset.frames[c].masks = numbered_files(path / "masks" / id, {".png"}, limits);
    dataset.frames[c].labels = numbered_files(path / "labels" / id, {".png"}, limits);
    dataset.frames[c].keypoints = numbered_files(path / "keypoints2d" / id, {".json"}, limits);
  }
  return dataset;
}

std::vector<std::string> write_native(const LayoutSource& source, const fs::path& out) {
  std::vector<std::string> lost;
  CaptureInfo info = source.dataset().info;
  info.image_format = image_format_of(source);
  info.label_taxonomy = "atelier";
  if (info.keypoint_schema.empty()) {
    info.keypoint_schema = "body_25";
  }
  if (info.synthetic) {
    info.synthetic = false;
    lost.emplace_back("the ground truth of a synthetic capture is left out");
  }
  const std::string extension = "." + info.image_format;
  for (std::size_t c = 0; c < source.cameras().size(); ++c) {
    const auto camera = static_cast<Index>(c);
    const std::string& id = source.cameras()[c].id;
    for (const int frame : source.sequence.frame_ids) {
      const fs::path stem = out / "images" / id / frame_name(frame);
      const std::optional<ImageHeader> header = source.frames().image_header(camera, frame);
      if (header) {
        const bool kept = header->format == ImageFormat::Png || info.image_format == "jpg";
        if (kept) {
          write_picture(source, camera, frame, stem);
        } else {
          make_private_directory(stem.parent_path());
          write_image(stem.string() + extension, *source.frames().byte_image(camera, frame));
          lost.emplace_back("images that were neither all JPEG nor PNG became PNG, 8 bit");
        }
      }
      const fs::path label_path = out / "labels" / id / (frame_name(frame) + ".png");
      std::optional<ByteImage> labels = source.frames().labels(camera, frame);
      if (labels && source.dataset().info.label_taxonomy != "atelier") {
        lost.emplace_back("labels become those of the taxonomy atelier, which has fewer");
      }
      if (!labels) {
        labels = source.frames().mask(camera, frame);  // 0: background, 255: unknown
        if (labels) {
          lost.emplace_back("masks become labels: background, and unknown on the person");
        }
      } else if (source.dataset().frames[c].masks.contains(frame)) {
        lost.emplace_back("masks are left out where there are labels");
      }
      if (labels) {
        make_private_directory(label_path.parent_path());
        write_labels(label_path, *labels);
      }
      write_keypoints(source, camera, frame,
                      out / "keypoints2d" / id / (frame_name(frame) + ".json"), 0);
    }
  }
  if (!source.dataset().keypoints3d.empty()) {
    lost.emplace_back("keypoints in space are left out");
  }
  write_file_atomically(out / "cameras.json", cameras_json(source.cameras()));
  if (info.sequences.empty()) {
    lost.emplace_back("there are no frames: only cameras.json is written, no finished capture");
  } else {
    write_file_atomically(out / "capture.toml", capture_toml(info));
  }
  return lost;
}

}  // namespace atelier
