#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "capture/masks/background.h"
#include "core/finding.h"

namespace atelier {

/// Auto: clean plates where they are given, else the most frequent colour of each pixel over time.
enum class MaskMethod { Auto, Plates, Chroma, Time };

/// Where a capture's masks come from.
struct MaskSources {
  std::string capture;
  std::string plates;  ///< images of the empty stage: <camera>.png, or a folder for each camera
  std::string truth;   ///< synthetic capture that the masks are compared with; "": none
};

struct CaptureMaskOptions {
  MaskMethod method = MaskMethod::Auto;
  int background_frames = 40;  ///< of each camera, from which the method Time learns
  MaskOptions mask;
  ChromaOptions chroma;
};

/// Outcome for one camera.
struct CameraMasks {
  int written = 0;
  double covered = 0;  ///< mean share of the image
  double iou = 0;      ///< against the ground truth, mean
  int judged = 0;
  std::vector<Finding> findings;
};

/// Labels of the ground truth, of one image.
std::filesystem::path true_mask_file(const MaskSources& sources, const std::string& camera,
                                     int frame);

/// Masks of the person in every image of the capture, as OUT/<camera>/<frame>.png. Images that
/// cannot be read are findings. Throws DataError for plates that are missing or of another size.
/// @param options  with another method than Auto
/// @return of each camera
std::vector<CameraMasks> make_masks(const Dataset& dataset, const MaskSources& sources,
                                    const CaptureMaskOptions& options,
                                    const std::filesystem::path& out);

}  // namespace atelier
