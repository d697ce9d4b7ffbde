#pragma once

#include <string>
#include <vector>

#include "capture/dataset.h"

namespace atelier {

/// An image with a calibration of its own, as COLMAP and nerfstudio list them.
struct PosedImage {
  std::string name;  ///< as the file gives it: "cam01/000003.png"
  Camera camera;     ///< without id
  DataLocation image;
  DataLocation mask;  ///< file "": none
};

/// The cameras and frames of a list of images: images whose names differ in the last number
/// alone and whose calibrations are the same (to 1e-9) are frames of one camera, called by what is
/// left of the name; every other image is a camera of its own with frame 0. Images of one
/// camera that moved are said in a finding. Throws DataError (`file`) for a name twice.
Dataset dataset_of(const std::vector<PosedImage>& images, const std::string& file);

}  // namespace atelier
