#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bodymodel/body_model.h"
#include "bodymodel/human/default_human.h"
#include "core/device.h"
#include "core/mesh.h"
#include "core/options.h"
#include "pipeline/outfit/dressing.h"
#include "simulation/solver.h"

namespace atelier {

/// How dressed cloth comes to rest unless something else is said: in as many substeps
/// as clothes have in motion.
inline SolverOptions settling_solver_options() {
  SolverOptions solver;
  solver.substeps = OutfitOptions{}.substeps;
  return solver;
}

struct DrapeOptions {
  std::string body = "female";
  std::string fit = "garment";
  int frames = 240;          ///< at most, 60 a second, once the garment is on
  bool video = true;         ///< a turntable, which takes as long as the rest
  double rest_speed = 0.01;  ///< m/s at most, that 99 of 100 vertices move
  SolverOptions settling = settling_solver_options();  ///< of the dressed cloth, to its rest
  Device device = Device::Cpu;
  OutfitOptions outfit;
  DefaultHumanOptions human;
};
OptionTable describe(DrapeOptions& options);

/// How a garment was put on, a picture's worth at a time.
struct Snapshot {
  std::string caption;
  Mesh cloth;
  Points body;
};

struct Draped {
  BodyModel body;
  Outfit outfit;
  std::vector<Snapshot> dressing;
  std::vector<Mesh> frames;  ///< of the dressed cloth coming to rest
  double speed = 0;          ///< m/s at the end
  FrameReport last;
};

/// Refuses options that are said and would do nothing to these garments on this body. Throws
/// UsageError.
void require_used_options(const DrapeOptions& options);

/// Sews the garments on the body and lets them come to rest. Throws as `dress_body`.
/// @param dressing  told of each frame of the dressing, from 0
Draped dress_and_settle(const DrapeOptions& options,
                        const std::function<void(std::size_t frame)>& dressing);

/// Writes garments at rest and the sequence in which they come to it, the body, images and, if
/// asked for, a turntable to a folder.
void write_draped(const std::filesystem::path& folder, const Draped& draped, bool video);

}  // namespace atelier
