#pragma once

#include <array>
#include <vector>

#include "bodymodel/human/human_template.h"

namespace atelier {

/// Where a vertex is in terms of anatomy rather than of space: in each part that it belongs to, the
/// station along the part, the direction round it and the distance as a share of the outline's. A
/// new anatomy moves the parts, and the vertex with them.
struct HumanCoordinates {
  struct InPart {
    double weight = 0;   ///< share of the part; a vertex's shares sum to 1
    double station = 0;  ///< tubes: station coordinate
    double cos_phi = 1, sin_phi = 0;
    double ratio = 0;         ///< tubes: distance from the section's centre over the outline's
    Vec3d local = {0, 0, 0};  ///< blocks (head, hand, foot): from the block's joint, middle build
  };
  std::vector<std::array<InPart, kHumanParts>> vertices;
};

/// Coordinates of the template's vertices.
HumanCoordinates human_coordinates(const HumanTemplate& body);

/// Vertices of the left half in an anatomy. The middle's x stays 0. Cost: 5 ms.
std::vector<Vec3d> human_surface(const HumanTemplate& body, const HumanCoordinates& coordinates,
                                 const HumanAnatomy& anatomy);

}  // namespace atelier
