#pragma once

#include <optional>

#include "core/sequence.h"

namespace atelier {

/// From here on, half of gravity, a garment is held up by its motion, so that no rest shape of it
/// hangs so [m/s2]. True tees of a stride are below 4.8 in all frames, dresses of a spin above 5.6
/// in all but the first. Our choice.
inline constexpr double kInMotion = 5.0;

/// How fast the motion changes of what hangs free of a garment in one frame [m/s2]: the median
/// length of second differences to the frames on either side, over vertices farther than 3 cm from
/// the body. None where a frame beside it is missing, or less than a twentieth of the vertices hang
/// free: what lies on a body is carried by it, however it moves.
///
/// @param registered  a garment in frame after frame, of one topology
/// @param frame_id    the capture's own number
/// @param body        [B,3] m, in that frame
std::optional<double> hanging_acceleration(const Sequence& registered, int frame_id,
                                           const Points& body, const Triangles& body_faces);

}  // namespace atelier
