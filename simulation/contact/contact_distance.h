#pragma once

#include <algorithm>

#include "core/garment.h"
#include "core/mesh_statistics.h"

namespace atelier {

/// The distance [m] that cloth with edges of `edge_length` [m] has to keep from a body so that it
/// does not show between the cloth's vertices, which alone meet what is smooth: the round of a
/// chest rises into a triangle by the square of its edge. 4 mm at least, and 10 cm, which is the
/// most that a solver takes, from edges of 9 cm on. Our choice.
inline double contact_distance(double edge_length) {
  constexpr double kLeast = 0.004;
  constexpr double kMost = 0.1;
  constexpr double kAtThreeCentimetres = 0.0105;
  const double share = edge_length / 0.03;
  return std::clamp(kAtThreeCentimetres * share * share, kLeast, kMost);
}

/// Default distance of a garment from a body [m]: the distance that its edges need, up to 2 cm,
/// since coarser cloth is no cloth; never less than its material is thick.
inline double contact_distance(const Garment& garment) {
  constexpr double kMost = 0.02;
  return std::max(garment.material.thickness,
                  std::min(kMost, contact_distance(mean_edge_length(garment.mesh))));
}

}  // namespace atelier
