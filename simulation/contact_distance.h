#pragma once

#include <algorithm>

namespace atelier {

/// The distance [m] that cloth with edges of `edge_length` [m] has to keep from a body so that it
/// does not show between the cloth's vertices, which alone meet it: the round of a chest rises into
/// a triangle by the square of its edge. 4 mm at least. Our choice.
inline double contact_distance(double edge_length) {
  constexpr double kLeast = 0.004;
  constexpr double kAtThreeCentimetres = 0.0105;
  const double share = edge_length / 0.03;
  return std::max(kLeast, kAtThreeCentimetres * share * share);
}

}  // namespace atelier
