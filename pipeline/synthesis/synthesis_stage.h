#pragma once

#include <filesystem>
#include <vector>

#include "capture/photograph.h"
#include "pipeline/synthesis/performance.h"

namespace atelier {

/// The part that all instants of a synthetic capture share: appearance, surroundings, cameras.
struct SynthesisStage {
  GroundTruth truth;            ///< with cameras and lights
  std::vector<Camera> cameras;  ///< the true ones
  std::vector<Camera> written;  ///< as their calibration says
  Look skin;
  Colors skin_colors;  ///< per vertex, where the body has no uvs
  std::vector<Look> layers;
  std::vector<Label> layer_labels;
  std::vector<Look> cloths;
  PreparedTextures textures;  ///< of all these looks
  Scene surroundings;
};

/// Sets it up: paints skin and cloth, hangs lights, mounts cameras. `truth` comes from
/// truth_of(performance) or from sequences in files.
SynthesisStage set_stage(GroundTruth truth, const std::vector<WornLayer>& layers,
                         const SynthesisOptions& options);

/// One instant before the cameras, `shift` seconds after the frame (for blur).
StageInstant instant_of(const SynthesisStage& stage, const PerformedFrame& frame, double shift = 0);

/// Images of a frame without noise or blur: linear light with exposure and gain, one image for each
/// camera.
std::vector<Image> clean_pictures(const SynthesisStage& stage, const PerformedFrame& frame,
                                  const std::vector<Camera>& cameras,
                                  const SynthesisOptions& options);

/// Writes what the cameras see of the empty stage: plates/<camera>.png.
void photograph_plates(const std::filesystem::path& folder, const SynthesisStage& stage,
                       const SynthesisOptions& options);

/// Writes what the cameras saw at one instant into the capture's folder: images, detections,
/// labels, truth. Files that are there are left as they are; the frame's ground truth comes last,
/// so that it says that all of them are. `stop` is asked between cameras; false comes back if it
/// said so.
bool photograph_instant(const std::filesystem::path& folder, const SynthesisStage& stage,
                        const PerformedFrame& frame, const SynthesisOptions& options,
                        const std::function<bool()>& stop);

}  // namespace atelier
