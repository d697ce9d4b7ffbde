#pragma once

#include <vector>

#include "simulation/contact/self_contact_math.h"
#include "simulation/xpbd/prepared_cloth.h"

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

/// The edges of triangles, each once, in the order of their ends. Of three triangles on an edge the
/// third has an edge of its own.
std::vector<ClothEdge> edges_of(const std::vector<FaceIndices>& faces);

/// Which side of a face, from corner k to k + 1, lies opposite to one of its corners.
inline int side_opposite(const FaceIndices& face, int corner) {
  return corner == face.c ? 0 : corner == face.a ? 1 : 2;
}

template <class T>
PreparedSurface<T> prepare_surface(const Cloth& cloth, const PreparedCloth<T>& prepared);

/// Metres that cloth keeps from itself: of the options or the cloth's material, but never above 0.4
/// of the median edge, so that a sheet does not meet its own neighbours.
double kept_self_thickness(const Cloth& cloth, const XpbdOptions& options);

/// The rule of self-contact: from the options or the cloth's material. `usual_interval`: where the
/// options leave it to the device.
template <class T>
SelfRule<T> self_rule(const Cloth& cloth, const XpbdOptions& options, int usual_interval);

extern template PreparedSurface<float> prepare_surface(const Cloth&, const PreparedCloth<float>&);
extern template PreparedSurface<double> prepare_surface(const Cloth&, const PreparedCloth<double>&);
extern template SelfRule<float> self_rule(const Cloth&, const XpbdOptions&, int);
extern template SelfRule<double> self_rule(const Cloth&, const XpbdOptions&, int);

}  // namespace atelier
