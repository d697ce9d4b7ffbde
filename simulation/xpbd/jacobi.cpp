#include <algorithm>

#include "simulation/xpbd/jacobi_math.h"

namespace atelier {

template <class T>
JacobiPlan<T> prepare_jacobi(const PreparedCloth<T>& cloth) {
  JacobiPlan<T> out;
  out.edges.resize(cloth.edges.size());
  out.triangles.resize(cloth.strains.size());
  for (const Schedule::Patch& patch : cloth.patches) {
    const auto particle = [&](std::uint16_t place) {
      return cloth.patch_particles[patch.vertex_begin + place];
    };
    const PreparedColour& first = cloth.colours[patch.colour_begin];
    const PreparedColour& last = cloth.colours[patch.colour_end];
    for (int e = first.edge_begin; e < last.edge_begin; ++e) {
      const bool bends = cloth.edge_rules[e].hinge_compliance >= 0;
      for (int c = 0; c < 4; ++c) {
        out.edges[e].particle[c] = particle(cloth.edges[e].at[c < 2 || bends ? c : c - 2]);
      }
    }
    for (int t = first.strain_begin; t < last.strain_begin; ++t) {
      for (int c = 0; c < 3; ++c) {
        out.triangles[t].particle[c] = particle(cloth.strain_places[t].at[c]);
      }
    }
  }
  // How many constraints move each particle, and which pushes it gets.
  std::vector<int> valence(static_cast<std::size_t>(cloth.count), 0);
  std::vector<int> pushes(valence.size(), 0);
  for (std::size_t e = 0; e < out.edges.size(); ++e) {
    const EdgeRule<T>& rule = cloth.edge_rules[e];
    for (int c = 0; c < 4; ++c) {
      const int v = out.edges[e].particle[c];
      const bool bends = rule.hinge_compliance >= 0;
      valence[v] += (bends ? 1 : 0) + (c < 2 && rule.spring_compliance >= 0 ? 1 : 0);
      pushes[v] += c < 2 || bends ? 1 : 0;
    }
  }
  for (const JacobiTriangle<T>& triangle : out.triangles) {
    for (int v : triangle.particle) {
      ++valence[v];
      ++pushes[v];
    }
  }
  out.begin.assign(pushes.size() + 1, 0);
  for (std::size_t v = 0; v < pushes.size(); ++v) {
    out.begin[v + 1] = out.begin[v] + pushes[v];
  }
  out.push.resize(static_cast<std::size_t>(out.begin.back()));
  std::vector<int> cursor(out.begin.begin(), out.begin.end() - 1);
  for (std::size_t e = 0; e < out.edges.size(); ++e) {
    int most = 1;
    for (int c = 0; c < (cloth.edge_rules[e].hinge_compliance >= 0 ? 4 : 2); ++c) {
      const int v = out.edges[e].particle[c];
      most = std::max(most, valence[v]);
      out.push[cursor[v]++] = static_cast<int>(4 * e) + c;
    }
    out.edges[e].share = T(1) / static_cast<T>(most);
  }
  for (std::size_t t = 0; t < out.triangles.size(); ++t) {
    int most = 1;
    for (int c = 0; c < 3; ++c) {
      const int v = out.triangles[t].particle[c];
      most = std::max(most, valence[v]);
      out.push[cursor[v]++] = static_cast<int>(4 * out.edges.size() + 3 * t) + c;
    }
    out.triangles[t].share = T(1) / static_cast<T>(most);
  }
  return out;
}

template JacobiPlan<float> prepare_jacobi(const PreparedCloth<float>&);
template JacobiPlan<double> prepare_jacobi(const PreparedCloth<double>&);

}  // namespace atelier
