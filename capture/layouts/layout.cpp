#include "capture/layouts/layout.h"

#include <algorithm>
#include <system_error>

#include "capture/camera_conventions.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/store/digest_meter.h"

namespace atelier {
namespace fs = std::filesystem;

FrameReader& LayoutSource::frames() const {
  if (stop && stop()) {
    throw StopRequested();
  }
  return *reader;
}

bool is_held_out(const LayoutSource& source, Index camera_idx, int frame_id) {
  const CaptureInfo& info = source.dataset().info;
  const std::string& camera = source.cameras()[static_cast<std::size_t>(camera_idx)].id;
  const auto& cameras = info.held_out_cameras;
  const auto& frames = info.held_out_frames;
  return std::find(cameras.begin(), cameras.end(), camera) != cameras.end() ||
         std::find(frames.begin(), frames.end(), frame_id) != frames.end();
}

std::string write_picture(const LayoutSource& source, Index camera_idx, int frame_id,
                          const fs::path& stem) {
  const std::optional<EncodedImage> image = source.frames().encoded_image(camera_idx, frame_id);
  if (!image) {
    return "";
  }
  const fs::path path = stem.string() + image->extension;
  make_private_directory(path.parent_path());
  AtomicFile file(path);
  file.write(image->bytes);
  file.commit();
  return image->extension;
}

bool write_mask(const LayoutSource& source, Index camera_idx, int frame_id, const fs::path& path) {
  const std::optional<ByteImage> mask = source.frames().mask(camera_idx, frame_id);
  if (!mask) {
    return false;
  }
  make_private_directory(path.parent_path());
  write_image(path, *mask);
  return true;
}

bool write_keypoints(const LayoutSource& source, Index camera_idx, int frame_id,
                     const fs::path& path, double shift) {
  if (!source.dataset().frames[static_cast<std::size_t>(camera_idx)].keypoints.contains(frame_id)) {
    return false;
  }
  make_private_directory(path.parent_path());
  write_file_atomically(path,
                        openpose_json(source.frames().keypoints(camera_idx, frame_id), shift));
  return true;
}

std::vector<Camera> cameras_in(const LayoutSource& source, const WorldConvention& world) {
  std::vector<Camera> cameras;
  for (const Camera& camera : source.cameras()) {
    cameras.push_back(in_file_world(camera, world));
  }
  return cameras;
}

}  // namespace atelier
