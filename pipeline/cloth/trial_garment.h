#pragma once

#include <string>
#include <vector>

#include "bodymodel/retarget/moving_body.h"
#include "pipeline/outfit/worn_cloth.h"
#include "registration/tracking/registered_outfit.h"

namespace atelier {

/// A garment coarse enough to be simulated many times, with its registered motion.
struct TrialGarment {
  std::string name;
  WornGarment worn;
  std::vector<Points> targets;     ///< [F] of [V,3] m, registered positions
  std::vector<Points> velocities;  ///< [F] of [V,3] m/s
  std::vector<int> patches;  ///< [V] the patch of each vertex, over which distances are averaged
  int patch_count = 0;
};

/// A registered garment with isotropic triangles of `edge_length` m, in the frames of the body's
/// motion. The rest length of an edge is its median over the frames.
/// @param body  [V,3] m, the body's surface in the first frame
TrialGarment trial_garment(const RegisteredGarmentSequence& garment, const MovingBody& moving,
                           const Points& body, const Material& material, double edge_length);

}  // namespace atelier
