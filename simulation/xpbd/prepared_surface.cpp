#include "simulation/xpbd/prepared_surface.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace atelier {

std::vector<ClothEdge> edges_of(const std::vector<FaceIndices>& faces) {
  struct Half {
    int low, high, face, opposite;
  };
  std::vector<Half> halves;
  halves.reserve(3 * faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const int v[3] = {faces[f].a, faces[f].b, faces[f].c};
    for (int c = 0; c < 3; ++c) {
      const int a = v[c];
      const int b = v[(c + 1) % 3];
      halves.push_back({std::min(a, b), std::max(a, b), static_cast<int>(f), v[(c + 2) % 3]});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  std::vector<ClothEdge> out;
  for (std::size_t i = 0; i < halves.size();) {
    const Half& h = halves[i];
    ClothEdge edge{h.low, h.high, {h.face, -1}, {h.opposite, -1}};
    std::size_t j = i + 1;
    if (j < halves.size() && halves[j].low == h.low && halves[j].high == h.high) {
      edge.face[1] = halves[j].face;
      edge.opposite[1] = halves[j].opposite;
      ++j;
    }
    out.push_back(edge);
    i = j;
  }
  return out;
}

template <class T>
PreparedSurface<T> prepare_surface(const Cloth& cloth, const PreparedCloth<T>& prepared) {
  PreparedSurface<T> out;
  for (Index f = 0; f < cloth.faces.rows(); ++f) {
    out.faces.push_back({prepared.internal[cloth.faces(f, 0)], prepared.internal[cloth.faces(f, 1)],
                         prepared.internal[cloth.faces(f, 2)]});
  }
  out.edges = edges_of(out.faces);
  out.across.assign(3 * out.faces.size(), -1);
  std::vector<std::vector<int>> ring(prepared.external.size());
  for (const ClothEdge& edge : out.edges) {
    ring[edge.a].push_back(edge.b);
    ring[edge.b].push_back(edge.a);
    for (int side = 0; side < 2; ++side) {
      const int face = edge.face[side];
      if (face < 0 || edge.face[1 - side] < 0) {
        continue;
      }
      const int k = side_opposite(out.faces[face], edge.opposite[side]);
      out.across[3 * static_cast<std::size_t>(face) + k] = edge.opposite[1 - side];
    }
  }
  out.ring_begin.push_back(0);
  for (const std::vector<int>& neighbours : ring) {
    out.ring.insert(out.ring.end(), neighbours.begin(), neighbours.end());
    out.ring_begin.push_back(static_cast<int>(out.ring.size()));
  }
  out.rest.resize(prepared.external.size());
  for (std::size_t i = 0; i < out.rest.size(); ++i) {
    const auto p = cloth.rest_positions.row(prepared.external[i]);
    out.rest[i] = {static_cast<T>(p[0]), static_cast<T>(p[1]), static_cast<T>(p[2]), T(0)};
    if (!cloth.layer.empty()) {
      out.layer.push_back(cloth.layer[prepared.external[i]]);
    }
  }
  return out;
}

namespace {

/// The percentile of the edges' lengths; 0 of a cloth without edges.
double edge_length_percentile(const Cloth& cloth, std::size_t percent) {
  std::vector<double> lengths;
  lengths.reserve(static_cast<std::size_t>(cloth.fibre_count));
  for (int i = 0; i < cloth.fibre_count; ++i) {
    lengths.push_back(cloth.springs[i].rest);
  }
  if (lengths.empty()) {
    return 0;
  }
  const std::size_t k = lengths.size() * percent / 100;
  std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(k),
                   lengths.end());
  return lengths[k];
}

}  // namespace

double kept_self_thickness(const Cloth& cloth, const XpbdOptions& options) {
  const double thickness =
      options.self_thickness >= 0 ? options.self_thickness : cloth.material.thickness;
  return cloth.fibre_count > 0 ? std::min(thickness, 0.4 * edge_length_percentile(cloth, 50))
                               : thickness;
}

template <class T>
SelfRule<T> self_rule(const Cloth& cloth, const XpbdOptions& options, int usual_interval) {
  const Material& m = cloth.material;
  const double thickness = kept_self_thickness(cloth, options);
  // Beyond the gap, to the neighbours in the cloth.
  const double room = std::max(0.0, 0.4 * edge_length_percentile(cloth, 10) - thickness);
  // Sheets that overlap part slowly, so that they do not jump; crossed ones are pulled at 0.2 m/s.
  const double h = options.time_step / options.substeps;
  SelfRule<T> rule{};
  rule.thickness = static_cast<T>(thickness);
  rule.friction = static_cast<T>(options.self_friction >= 0 ? options.self_friction : m.friction);
  rule.old_overlap = static_cast<T>(0.2 * std::min(1.0, options.depenetration_speed) * h);
  rule.horizon = std::min(options.self_interval > 0 ? options.self_interval : usual_interval,
                          options.substeps);
  // Slack costs pairs, up to what neighbours in the cloth leave free, and saves searches; and what
  // gravity adds to the flight while a search holds.
  const double slack = std::max(0.05 * thickness, 1e-4) + std::min(0.4 * room, 0.5 * thickness);
  const double span = h * rule.horizon;
  rule.slack = static_cast<T>(slack + 5 * span * span);
  rule.untangle = static_cast<T>(0.2 * h);
  return rule;
}

template PreparedSurface<float> prepare_surface(const Cloth&, const PreparedCloth<float>&);
template PreparedSurface<double> prepare_surface(const Cloth&, const PreparedCloth<double>&);
template SelfRule<float> self_rule(const Cloth&, const XpbdOptions&, int);
template SelfRule<double> self_rule(const Cloth&, const XpbdOptions&, int);

}  // namespace atelier
