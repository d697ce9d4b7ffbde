#include "capture/layouts/capture_lacks.h"

namespace atelier {
namespace {

constexpr const char* kNoMasks =
    "no frame has images with masks or labels of two cameras; atelier masks creates masks";

std::string no_cameras(const CaptureFacts& facts) {
  return !facts.calibrated   ? "the cameras are not calibrated; atelier calibrate calibrates them"
         : facts.cameras < 2 ? "there are fewer than two cameras that stages may open"
                             : "";
}

}  // namespace

std::string lacks_evidence(const CaptureFacts& facts) {
  const std::string cameras = no_cameras(facts);
  return !cameras.empty() ? cameras
         : facts.masked_frames == 0 && !facts.detections
             ? "neither masks of two cameras nor 2D keypoints; atelier masks and atelier detect "
               "create them"
             : "";
}

std::string lacks_keypoints(const CaptureFacts& facts) {
  const std::string evidence = lacks_evidence(facts);
  return !evidence.empty()   ? evidence
         : !facts.detections ? "no 2D keypoints; atelier detect creates them"
                             : "";
}

std::string lacks_masks(const CaptureFacts& facts) {
  return facts.masked_frames == 0 ? kNoMasks : "";
}

std::string lacks_clothes(const CaptureFacts& facts) {
  return facts.masked_frames == 0    ? kNoMasks
         : facts.clothed_frames == 0 ? "no clothed sequence has masks"
                                     : "";
}

}  // namespace atelier
