#pragma once

#include "core/mesh.h"

namespace atelier {

/// How far a garment lies off the body where it rests on it [m], as on shoulders and on the chest:
/// the lower quartile of the distances of its vertices that are over skin which looks up (a normal
/// with more than 0.7 of +Y), within 2 cm. Cloth that hangs beside a body says nothing of the skin
/// that carries it, and half of what is over a shoulder spans it. Where fewer than 20 of its
/// vertices, or than a hundredth of them, lie so, whichever is less, `otherwise`. Our choice.
///
/// @param cloth       [V,3] m, as captured
/// @param body        [B,3] m, in the same moment
/// @param body_faces  counter-clockwise from outside
double resting_gap(const Points& cloth, const Points& body, const Triangles& body_faces,
                   double otherwise);

}  // namespace atelier
