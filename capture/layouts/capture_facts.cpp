#include "capture/layouts/capture_facts.h"

#include <algorithm>
#include <map>

namespace atelier {
namespace {

/// Images and masks of one frame, over all cameras.
struct FrameViews {
  int pictures = 0;
  int masks = 0;  ///< of those with an image
};

std::map<int, FrameViews> views_of(const Dataset& dataset, CaptureFacts& facts) {
  std::map<int, FrameViews> frames;
  const std::vector<std::string>& held = dataset.info.held_out_cameras;
  double pixels = 0;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    const Camera& camera = dataset.cameras[c];
    if (std::find(held.begin(), held.end(), camera.id) != held.end()) {
      continue;
    }
    const CameraFrames& has = dataset.frames[c];
    facts.cameras += 1;
    facts.detections = facts.detections || !has.keypoints.empty();
    pixels += 1e-6 * camera.width * camera.height;
    for (const auto& [frame, place] : has.images) {
      frames[frame].pictures += 1;
      frames[frame].masks += has.masks.contains(frame) || has.labels.contains(frame) ? 1 : 0;
    }
  }
  facts.megapixels = facts.cameras > 0 ? pixels / facts.cameras : 0;
  return frames;
}

}  // namespace

CaptureFacts capture_facts(const std::filesystem::path& capture, const DatasetOptions& options) {
  const Dataset dataset = open_dataset(capture, options);
  CaptureFacts facts;
  facts.calibrated = dataset.calibrated;
  facts.synthetic = dataset.info.synthetic;
  const std::map<int, FrameViews> frames = views_of(dataset, facts);
  for (const CaptureSequence& sequence : dataset.info.sequences) {
    for (const int id : sequence.frame_ids) {
      const auto found = frames.find(id);
      const FrameViews views = found == frames.end() ? FrameViews{} : found->second;
      const int masked = views.masks >= 2 ? 1 : 0;
      facts.frames += 1;
      facts.pictured_frames += views.pictures > 0 ? 1 : 0;
      facts.masked_frames += masked;
      (sequence.kind == "minimal" ? facts.minimal_frames : facts.clothed_frames) += masked;
    }
  }
  return facts;
}

}  // namespace atelier
