#pragma once

#include <vector>

#include "core/types.h"
#include "registration/tracking/register_sequence.h"

namespace atelier {

/// The body of a step, at its start and its end.
struct SteppingBody {
  const Triangles& faces;  ///< [.,3]
  Points start, end;       ///< [B,3] m
};

/// Physical prediction of cloth one frame later: simulated for the time of a frame, with the moving
/// body as an obstacle and rest lengths as at the start. Velocities begin as those of the last two
/// frames where these are reliable, as those of the body-driven prediction elsewhere; vertices that
/// are not `free` follow the body-driven prediction throughout. Materials are unknown: the default
/// one's (core/garment.h), without drag, so that time may run backwards. Our choice.
/// @param free     [V] 1: hangs free of the body
/// @param seconds  from frame to frame, above 0
/// @return [V,3] m; no rows where nothing or everything is free, the frame before is not known, or
///         the cloth cannot be simulated
Points simulated_prediction(const Triangles& faces, const std::vector<char>& free,
                            const ClothStep& step, const SteppingBody& body, double seconds);

}  // namespace atelier
