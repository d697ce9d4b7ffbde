#pragma once

#include <vector>

#include "simulation/prepared_cloth.h"
#include "simulation/self_contact_math.h"

namespace atelier {

/// The triangles and edges of a cloth, over its particles, for contacts with itself.
template <class T>
struct PreparedSurface {
  std::vector<FaceIndices> faces;
  std::vector<ClothEdge> edges;
  std::vector<int> across;  ///< [3 F] see SelfView
  std::vector<int> ring_begin, ring;
  std::vector<Vec4<T>> rest;
  std::vector<int> layer;  ///< empty: one layer
};

template <class T>
PreparedSurface<T> prepare_surface(const Cloth& cloth, const PreparedCloth<T>& prepared);

/// The rule of self-contact: from the options or the cloth's material; the gap is never above 0.4
/// of the median edge, so that a sheet does not meet its own neighbours. `usual_interval`: where
/// the options leave it to the device.
template <class T>
SelfRule<T> self_rule(const Cloth& cloth, const XpbdOptions& options, int usual_interval);

extern template PreparedSurface<float> prepare_surface(const Cloth&, const PreparedCloth<float>&);
extern template PreparedSurface<double> prepare_surface(const Cloth&, const PreparedCloth<double>&);
extern template SelfRule<float> self_rule(const Cloth&, const XpbdOptions&, int);
extern template SelfRule<double> self_rule(const Cloth&, const XpbdOptions&, int);

}  // namespace atelier
