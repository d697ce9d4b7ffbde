#include "capture/settle_convention.h"

#include <algorithm>
#include <optional>
#include <string>

#include "capture/camera_conventions.h"
#include "capture/rig_convention.h"
#include "capture/silhouettes.h"
#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {
namespace {

constexpr std::size_t kMostCameras = 16;

/// Cameras with the masks of one frame: some, spread over all.
struct MaskedRig {
  std::vector<Camera> cameras;  ///< as they hang: without the turns of their images
  std::vector<int> turns;       ///< quarters
  std::vector<ByteImage> masks;
};

MaskedRig masked_rig(FrameReader& reader, int frame) {
  const Dataset& dataset = reader.dataset();
  MaskedRig rig;
  const std::size_t step = std::max<std::size_t>(1, dataset.cameras.size() / kMostCameras);
  for (std::size_t c = 0; c < dataset.cameras.size(); c += step) {
    try {
      std::optional<ByteImage> mask = reader.mask(static_cast<Index>(c), frame);
      const Camera& camera = dataset.cameras[c];
      if (mask && mask->width == camera.width && mask->height == camera.height) {
        rig.cameras.push_back(turned_camera(camera, -dataset.frames[c].turn));
        rig.turns.push_back(dataset.frames[c].turn);
        rig.masks.push_back(std::move(*mask));
      }
    } catch (const DataError&) {  // check_frames says so
    }
  }
  return rig;
}

double agreement_under(const MaskedRig& rig, const WorldConvention& world,
                       const std::string& value) {
  std::vector<Camera> hung;
  std::vector<Camera> meant;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    hung.push_back(extrinsics_read_as(rig.cameras[c], world, value));
    meant.push_back(turned_camera(hung.back(), rig.turns[c]));
  }
  return silhouette_agreement(meant, rig.masks, gaze_of(hung).place);
}

std::vector<int> masked_frames(const Dataset& dataset) {
  std::vector<int> frames = frame_ids(dataset);
  std::erase_if(frames, [&](int frame) {
    return std::none_of(dataset.frames.begin(), dataset.frames.end(),
                        [&](const CameraFrames& camera) {
                          return camera.masks.contains(frame) || camera.labels.contains(frame);
                        });
  });
  if (frames.size() > 2) {
    frames = {frames[frames.size() / 4], frames[3 * frames.size() / 4]};
  }
  return frames;
}

/// The convention with which alone the masks agree, and how well.
struct ToldByMasks {
  std::string value;
  double agreement = 0;
  double as_read = 0;
};

std::optional<ToldByMasks> told_by_masks(FrameReader& reader) {
  const Dataset& dataset = reader.dataset();
  std::vector<Camera> cameras;
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    cameras.push_back(turned_camera(dataset.cameras[c], -dataset.frames[c].turn));
  }
  const std::vector<int> frames = masked_frames(dataset);
  if (frames.empty()) {
    return std::nullopt;
  }
  std::vector<MaskedRig> rigs;
  for (const int frame : frames) {
    rigs.push_back(masked_rig(reader, frame));
  }
  ToldByMasks best;
  double second = 0;
  for (const RigReading& reading : rig_readings(cameras, dataset.world_convention)) {
    if (!reading.possible && !reading.value.empty()) {
      continue;
    }
    double agreement = 0;
    for (const MaskedRig& rig : rigs) {
      agreement += agreement_under(rig, dataset.world_convention, reading.value) /
                   static_cast<double>(rigs.size());
    }
    if (agreement > best.agreement) {
      second = best.agreement;
      best.value = reading.value;
      best.agreement = agreement;
    } else {
      second = std::max(second, agreement);
    }
    best.as_read = reading.value.empty() ? agreement : best.as_read;
  }
  constexpr double kAgree = 0.8;  // masks of real captures miss a little
  constexpr double kMore = 0.05;
  return best.agreement > kAgree && best.agreement > second + kMore ? std::optional(best)
                                                                    : std::nullopt;
}

bool is_of_convention(const Finding& finding) {
  return finding.code == "extrinsics-untold" || finding.code == "extrinsics-doubtful" ||
         finding.code == "cameras-apart";
}

}  // namespace

void settle_convention(std::vector<Finding>& findings, FrameReader& reader,
                       const KeypointCheck& keypoints) {
  const auto finding = std::find_if(findings.begin(), findings.end(), is_of_convention);
  if (finding == findings.end()) {
    return;
  }
  if (keypoints.calibration_fits) {
    std::erase_if(findings, [](const Finding& one) {
      return is_of_convention(one) && one.code != "cameras-apart";
    });
    return;
  }
  const std::optional<ToldByMasks> told = told_by_masks(reader);
  if (told && told->value.empty()) {
    findings.erase(finding);
  } else if (told) {
    finding->severity = Severity::Error;
    finding->what = "of the masks " + percent(told->as_read) + " agree with each other, and " +
                    percent(told->agreement) + " in another convention of the extrinsics";
    finding->advice = "read all cameras so, or rewrite the files";
    finding->setting = "--capture.extrinsics all=" + told->value;
  }
}

}  // namespace atelier
