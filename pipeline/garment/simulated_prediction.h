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

/// Where cloth is after a step by its own dynamics: simulated over the time of a frame, with the
/// moving body as an obstacle. It has the lengths that it has at the start. It begins as fast as it
/// came from the frame before where that is sure, else as fast as it is led, and it is led all the
/// way where it is not `free`. Materials are unknown: the default one's (core/garment.h), without
/// drag, so that time may run backwards. Our choice.
/// @param free     [V] 1: hangs free from the body
/// @param seconds  from frame to frame, above 0
/// @return [V,3] m; no rows where nothing or everything is free, the frame before is not known, or
///         the cloth cannot be simulated
Points simulated_prediction(const Triangles& faces, const std::vector<char>& free,
                            const ClothStep& step, const SteppingBody& body, double seconds);

}  // namespace atelier
