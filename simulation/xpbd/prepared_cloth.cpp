#include "simulation/xpbd/prepared_cloth.h"

#include <algorithm>

#include "core/error.h"

namespace atelier {
namespace {

/// Inverse of a stiffness [m/N, or its like]. What is softer than any cloth is kept finite, also in
/// float and over the square of a substep: infinity times a multiplier of 0 is no number.
template <class T>
T compliance_of(double stiffness) {
  constexpr double kMost = 1e20;
  return static_cast<T>(stiffness * kMost > 1 ? 1 / stiffness : kMost);
}

}  // namespace

template <class T>
PreparedCloth<T> prepare_cloth(const Cloth& cloth) {
  PreparedCloth<T> out;
  const Schedule& schedule = cloth.schedule;
  const int n = static_cast<int>(cloth.mass.size());
  out.count = n;
  out.phases = schedule.phases;
  out.patches = schedule.patches;
  out.max_patch_particles = schedule.max_patch_vertices;
  ATELIER_CHECK(schedule.max_patch_vertices < kNoPlace,
                "a patch holds more particles than its indices can name");
  ATELIER_CHECK(!schedule.phases.empty(), "the cloth has no schedule: call rebuild_schedule");
  const int last_first = schedule.phases[0].patch_end - 1;
  ATELIER_CHECK(schedule.patches[last_first].vertex_end == n, "the schedule is of another cloth");
  out.external.assign(schedule.vertices.begin(), schedule.vertices.begin() + n);
  out.internal.assign(static_cast<std::size_t>(n), 0);
  for (int i = 0; i < n; ++i) {
    out.internal[out.external[i]] = i;
  }
  out.patch_particles.reserve(schedule.vertices.size());
  for (int v : schedule.vertices) {
    out.patch_particles.push_back(out.internal[v]);
  }
  out.inverse_mass.resize(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    const int v = out.external[i];
    out.inverse_mass[i] = cloth.fixed[v] ? T(0) : static_cast<T>(1 / cloth.mass[v]);
  }
  const int springs = static_cast<int>(cloth.springs.size());
  const int hinges = springs + static_cast<int>(cloth.hinges.size());
  std::vector<std::uint16_t> place(static_cast<std::size_t>(n), 0);
  const auto hinge_of = [&](int i) -> const ClothHinge& {
    return cloth.hinges[schedule.order[i] - springs];
  };
  for (std::size_t p = 0; p < schedule.patches.size(); ++p) {
    const Schedule::Patch& patch = schedule.patches[p];
    out.patches[p].colour_begin = static_cast<int>(out.colours.size());
    for (int i = patch.vertex_begin; i < patch.vertex_end; ++i) {
      place[schedule.vertices[i]] = static_cast<std::uint16_t>(i - patch.vertex_begin);
    }
    for (int k = patch.colour_begin; k < patch.colour_end; ++k) {
      const Schedule::Colour& colour = schedule.colours[k];
      const int edges = colour.begin[2] - colour.begin[0] - colour.paired;
      const int parts = std::max(1, (edges + kColourEdges - 1) / kColourEdges);
      int part = 0;
      for (int e = 0; e < edges || part == 0; ++e) {
        if (e * static_cast<std::int64_t>(parts) >= static_cast<std::int64_t>(part) * edges &&
            part < parts) {
          out.colours.push_back(
              {static_cast<int>(out.edges.size()), static_cast<int>(out.strains.size())});
          ++part;
        }
        if (e == edges) {
          break;
        }
        const int hinge = colour.begin[0] + e;
        const bool bends = hinge < colour.begin[1];
        const int spring = !bends              ? colour.begin[0] + colour.paired + e
                           : e < colour.paired ? colour.begin[1] + e
                                               : -1;
        Places at{{0, 0, kNoPlace, kNoPlace}};
        EdgeRule<T> rule{T(0), T(-1), T(0), T(-1)};
        if (spring >= 0) {
          const ClothSpring& s = cloth.springs[schedule.order[spring]];
          at.at[0] = place[s.a];
          at.at[1] = place[s.b];
          rule.rest_length = static_cast<T>(s.rest);
          rule.spring_compliance = compliance_of<T>(s.stiffness);
        }
        if (bends) {
          const ClothHinge& h = hinge_of(hinge);
          at = {{place[h.edge0], place[h.edge1], place[h.left], place[h.right]}};
          rule.rest_angle = static_cast<T>(h.rest);
          rule.hinge_compliance = compliance_of<T>(h.stiffness);
        }
        out.edges.push_back(at);
        out.edge_rules.push_back(rule);
        out.hinge_place.push_back(bends ? hinge : -1);
        out.spring_place.push_back(spring);
      }
      for (int i = colour.begin[2]; i < colour.begin[3]; ++i) {
        const ClothStrain& s = cloth.strains[schedule.order[i] - hinges];
        out.strain_index.push_back(schedule.order[i] - hinges);
        out.strain_places.push_back({{place[s.v0], place[s.v1], place[s.v2], kNoPlace}});
        out.strains.push_back({static_cast<T>(s.inverse_rest[0]), static_cast<T>(s.inverse_rest[1]),
                               static_cast<T>(s.inverse_rest[2]), static_cast<T>(s.inverse_rest[3]),
                               compliance_of<T>(s.warp), compliance_of<T>(s.weft),
                               compliance_of<T>(s.shear)});
      }
    }
    out.patches[p].colour_end = static_cast<int>(out.colours.size());
  }
  out.colours.push_back({static_cast<int>(out.edges.size()), static_cast<int>(out.strains.size())});
  if (!cloth.tethers.empty()) {
    out.tether_anchor.assign(static_cast<std::size_t>(n), -1);
    out.tether_length.assign(static_cast<std::size_t>(n), T(0));
    for (const ClothTether& t : cloth.tethers) {
      out.tether_anchor[out.internal[t.vertex]] = out.internal[t.anchor];
      out.tether_length[out.internal[t.vertex]] = static_cast<T>(t.length);
    }
  }
  return out;
}

template <class T>
std::vector<double> multipliers_in_order(const PreparedCloth<T>& cloth,
                                         const EdgeMultipliers<T>* lambda,
                                         std::size_t constraints) {
  std::vector<double> out(constraints, 0.0);
  for (std::size_t e = 0; e < cloth.edges.size(); ++e) {
    if (cloth.hinge_place[e] >= 0) {
      out[cloth.hinge_place[e]] = static_cast<double>(lambda[e].hinge);
    }
    if (cloth.spring_place[e] >= 0) {
      out[cloth.spring_place[e]] = static_cast<double>(lambda[e].spring);
    }
  }
  return out;
}

template <class T>
std::vector<std::array<double, 3>> strain_multipliers(const PreparedCloth<T>& cloth,
                                                      const T* lambda) {
  std::vector<std::array<double, 3>> out(cloth.strain_index.size());
  for (std::size_t t = 0; t < out.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      out[static_cast<std::size_t>(cloth.strain_index[t])][k] =
          static_cast<double>(lambda[3 * t + k]);
    }
  }
  return out;
}

template PreparedCloth<float> prepare_cloth(const Cloth&);
template PreparedCloth<double> prepare_cloth(const Cloth&);
template std::vector<double> multipliers_in_order(const PreparedCloth<float>&,
                                                  const EdgeMultipliers<float>*, std::size_t);
template std::vector<double> multipliers_in_order(const PreparedCloth<double>&,
                                                  const EdgeMultipliers<double>*, std::size_t);
template std::vector<std::array<double, 3>> strain_multipliers(const PreparedCloth<float>&,
                                                               const float*);
template std::vector<std::array<double, 3>> strain_multipliers(const PreparedCloth<double>&,
                                                               const double*);

}  // namespace atelier
