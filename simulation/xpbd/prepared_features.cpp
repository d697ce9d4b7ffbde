#include "simulation/xpbd/prepared_features.h"

#include <algorithm>

namespace atelier {

std::vector<int> edges_of_faces(const std::vector<FaceIndices>& faces,
                                const std::vector<ClothEdge>& edges, bool all) {
  std::vector<int> out(3 * faces.size(), -1);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    for (int side = 0; side < (all ? 2 : 1); ++side) {
      const int face = edges[e].face[side];
      if (face >= 0) {
        const int k = side_opposite(faces[face], edges[e].opposite[side]);
        out[3 * static_cast<std::size_t>(face) + k] = static_cast<int>(e);
      }
    }
  }
  return out;
}

PreparedFeatures prepare_features(const std::vector<FaceIndices>& faces) {
  PreparedFeatures out;
  out.edges = edges_of(faces);
  out.edge_of = edges_of_faces(faces, out.edges, true);
  out.corner_of.assign(3 * faces.size(), -1);
  std::vector<std::vector<int>> ring;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const int corner[3] = {faces[f].a, faces[f].b, faces[f].c};
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(corner[k]);
      if (v >= ring.size()) {
        ring.resize(v + 1);
      }
      if (ring[v].empty()) {
        out.corner_of[3 * f + k] = corner[k];
      }
      ring[v].push_back(static_cast<int>(f));
    }
  }
  out.ring_begin.push_back(0);
  for (const std::vector<int>& around : ring) {
    out.ring.insert(out.ring.end(), around.begin(), around.end());
    out.ring_begin.push_back(static_cast<int>(out.ring.size()));
  }
  return out;
}

template <class T>
std::vector<T> longest_edges(const PreparedSurface<T>& surface) {
  std::vector<T> out;
  out.reserve(surface.faces.size());
  for (const FaceIndices& f : surface.faces) {
    const Vec3<T> a = xyz(surface.rest[f.a]);
    const Vec3<T> b = xyz(surface.rest[f.b]);
    const Vec3<T> c = xyz(surface.rest[f.c]);
    out.push_back(std::max({norm(b - a), norm(c - b), norm(a - c)}));
  }
  return out;
}

template <class T>
FeatureRule<T> feature_rule(const BodyContactRule<T>& body) {
  FeatureRule<T> rule{};
  rule.gap = T(0.5) * body.thickness;
  rule.within = max_of(body.thickness, T(1e-3));
  rule.push.thickness = rule.gap;
  rule.push.friction = body.friction;
  rule.push.old_overlap = body.old_overlap;
  return rule;
}

template std::vector<float> longest_edges(const PreparedSurface<float>&);
template std::vector<double> longest_edges(const PreparedSurface<double>&);
template FeatureRule<float> feature_rule(const BodyContactRule<float>&);
template FeatureRule<double> feature_rule(const BodyContactRule<double>&);

}  // namespace atelier
