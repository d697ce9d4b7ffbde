#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "simulation/xpbd/constraint_math.h"
#include "simulation/xpbd/xpbd.h"

namespace atelier {

/// Particles of an edge by their place in the patch: its ends, then the corners across it (kNoPlace
/// where there is no hinge); or the three corners of a strain triangle.
struct alignas(8) Places {
  std::uint16_t at[4];
};
constexpr std::uint16_t kNoPlace = 0xFFFF;

/// The constraints along an edge: a hinge, then a spring; or only one of them. Compliances are 1 /
/// stiffness, before the division by h^2, below 0 where there is none.
template <class T>
struct alignas(4 * sizeof(T)) EdgeRule {
  T rest_angle, hinge_compliance;
  T rest_length, spring_compliance;
};

/// Multipliers of an edge.
template <class T>
struct alignas(2 * sizeof(T)) EdgeMultipliers {
  T hinge, spring;
};

/// First edge and first strain triangle of a colour; they end where the next colour begins. At most
/// kColourEdges edges: a wider colour of the schedule becomes several, so that a block has a thread
/// for every edge.
constexpr int kColourEdges = 256;
struct PreparedColour {
  int edge_begin, strain_begin;
};

/// Edges, as the report and contacts read them.
struct PreparedEdge {
  int a, b;
};

/// A Cloth in the order and precision in which it is solved. Particles are renumbered so that those
/// of a phase-0 patch are neighbours in memory.
template <class T>
struct PreparedCloth {
  int count = 0;
  std::vector<int> external;    ///< [V] the cloth's vertex of each particle
  std::vector<int> internal;    ///< [V] the particle of each vertex
  std::vector<T> inverse_mass;  ///< [V] 0: fixed
  std::vector<Schedule::Phase> phases;
  std::vector<Schedule::Patch> patches;  ///< with these colours
  std::vector<PreparedColour> colours;   ///< and one more for the end
  std::vector<int> patch_particles;
  std::vector<Places> edges;  ///< colour after colour
  std::vector<EdgeRule<T>> edge_rules;
  std::vector<Places> strain_places;
  std::vector<StrainRest<T>> strains;
  std::vector<int> strain_index;   ///< the cloth's strain of each
  std::vector<int> hinge_place;    ///< of each edge in the schedule's order, -1: none
  std::vector<int> spring_place;   ///< likewise
  std::vector<int> tether_anchor;  ///< [V] particle, or -1; empty: no tethers
  std::vector<T> tether_length;
  int max_patch_particles = 0;
};

template <class T>
PreparedCloth<T> prepare_cloth(const Cloth& cloth);

/// Multipliers of edges in the order of the schedule (0 for strain triangles).
template <class T>
std::vector<double> multipliers_in_order(const PreparedCloth<T>& cloth,
                                         const EdgeMultipliers<T>* lambda, std::size_t constraints);

/// Three multipliers (warp, weft, shear) of each strain of the cloth, from those in the order of
/// `strains`.
template <class T>
std::vector<std::array<double, 3>> strain_multipliers(const PreparedCloth<T>& cloth,
                                                      const T* lambda);

extern template PreparedCloth<float> prepare_cloth(const Cloth&);
extern template PreparedCloth<double> prepare_cloth(const Cloth&);
extern template std::vector<double> multipliers_in_order(const PreparedCloth<float>&,
                                                         const EdgeMultipliers<float>*,
                                                         std::size_t);
extern template std::vector<double> multipliers_in_order(const PreparedCloth<double>&,
                                                         const EdgeMultipliers<double>*,
                                                         std::size_t);
extern template std::vector<std::array<double, 3>> strain_multipliers(const PreparedCloth<float>&,
                                                                      const float*);
extern template std::vector<std::array<double, 3>> strain_multipliers(const PreparedCloth<double>&,
                                                                      const double*);

}  // namespace atelier
