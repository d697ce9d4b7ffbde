#pragma once

#include <filesystem>

#include "capture/layouts/open_dataset.h"

namespace atelier {

/// Facts of a capture that decide which stages can run on it and how long they take. Of the cameras
/// that stages may open: held-out ones are not counted.
struct CaptureFacts {
  bool calibrated = false;
  bool synthetic = false;  ///< there is a ground truth to compare with
  int cameras = 0;
  int frames = 0;           ///< of all sequences
  int pictured_frames = 0;  ///< with an image of some camera
  int masked_frames = 0;    ///< with images and masks or labels of two cameras
  int clothed_frames = 0;   ///< of those, in a clothed sequence
  int minimal_frames = 0;   ///< of those, in a minimally clothed one
  bool detections = false;  ///< 2D keypoints of some image
  double megapixels = 0;    ///< of one camera's image, on average
};

/// Opens a capture's index. Throws as open_dataset does.
CaptureFacts capture_facts(const std::filesystem::path& capture, const DatasetOptions& options);

}  // namespace atelier
