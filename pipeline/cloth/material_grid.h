#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "core/camera.h"
#include "core/image.h"
#include "pipeline/cloth/material_trials.h"

namespace atelier {

/// View of the garments in a camera of the capture.
struct TakenGarments {
  Camera camera;  ///< cut to the garments and scaled, without distortion
  Image picture;  ///< [H,W,3] linear light, of the camera's size
  std::string caption;
};

/// The picture of the last frame that trials are compared in, of the camera that shows most of the
/// registered garments: the largest sum of pixels of their triangles that face it, lie in the image
/// and are not behind the body. Cut to them with a tenth to spare. Nothing where no camera that
/// stages may open has a picture of that frame, or the capture has no calibration. Throws DataError
/// for a picture that cannot be read.
std::optional<TakenGarments> taken_garments(const Dataset& dataset, const Trials& trials);

/// Where the garments are at the end of the coarse grid's scenes, stretching over columns, bending
/// over rows; in front of each row what the capture shows of that frame, seen by the same camera
/// and cut alike, for a person to choose by eye (Xiang et al. 2021, Fig. 1). Without a picture the
/// garments are seen from the front and one side.
/// @param columns  of the grid
Image material_grid(const Trials& trials, const std::vector<std::vector<Stiffness>>& scenes,
                    const std::vector<SceneResult>& results, int columns,
                    const std::optional<TakenGarments>& taken);

}  // namespace atelier
