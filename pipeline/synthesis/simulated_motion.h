#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/io/ground_truth_archive.h"

namespace atelier {

/// A motion that a synthetic capture does not show: its subject in its clothes, of which ground
/// truth has only the drape at rest, simulated and seen in its light.
struct SimulatedMotion {
  std::string motion;
  std::vector<GroundTruthFrame> frames;      ///< numbered from 0
  std::vector<std::vector<Image>> pictures;  ///< [frame][camera] linear light with gain, no noise
};

/// Simulates it and takes images of its frames by `cameras`. The same bytes every time. None
/// where the capture cannot be played again: it does not say its options, another version made it,
/// its meshes came from files, its body's file is another now, or the cloth does not follow the
/// motion.
std::optional<SimulatedMotion> simulate_motion(const std::filesystem::path& capture,
                                               const GroundTruth& truth,
                                               const std::vector<Camera>& cameras);

}  // namespace atelier
