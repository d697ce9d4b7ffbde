#pragma once

#include <vector>

#include "simulation/contact/body_feature_math.h"
#include "simulation/xpbd/prepared_surface.h"

namespace atelier {

/// Edges and corners of a body's triangles, see BodyFeatures.
struct PreparedFeatures {
  std::vector<ClothEdge> edges;
  std::vector<int> edge_of, corner_of;
  std::vector<int> ring_begin, ring;
};
PreparedFeatures prepare_features(const std::vector<FaceIndices>& faces);

/// Edge of each face from corner k to k + 1, [3 F]. Unless `all`, -1 where another face stands for
/// it, so that each edge comes once.
std::vector<int> edges_of_faces(const std::vector<FaceIndices>& faces,
                                const std::vector<ClothEdge>& edges, bool all);

/// The longest edge of each triangle of the cloth in its template [m].
template <class T>
std::vector<T> longest_edges(const PreparedSurface<T>& surface);

/// The rule of the body's features, from what vertices obey. A feature keeps half of their
/// distance, so that it pushes where vertices cannot and nowhere else (our choice).
template <class T>
FeatureRule<T> feature_rule(const BodyContactRule<T>& body);

extern template std::vector<float> longest_edges(const PreparedSurface<float>&);
extern template std::vector<double> longest_edges(const PreparedSurface<double>&);
extern template FeatureRule<float> feature_rule(const BodyContactRule<float>&);
extern template FeatureRule<double> feature_rule(const BodyContactRule<double>&);

}  // namespace atelier
