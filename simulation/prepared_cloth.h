#pragma once

#include <cstdint>
#include <vector>

#include "simulation/constraint_math.h"
#include "simulation/xpbd.h"

namespace atelier {

/// One spring or hinge as solvers read it: particles by their place in the patch.
template <class T>
struct alignas(16) ConstraintRecord {
  std::uint16_t particle[4];
  T rest;
  T compliance;  ///< 1 / stiffness, before the division by h^2
};

/// A colour of a patch, with the place of its first strain triangle.
struct PreparedColour {
  int begin[4];
  int strain_begin;
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
  std::vector<Schedule::Patch> patches;
  std::vector<PreparedColour> colours;
  std::vector<int> patch_particles;
  std::vector<ConstraintRecord<T>> records;
  std::vector<StrainRest<T>> strains;  ///< in the order of the schedule
  std::vector<int> tether_anchor;      ///< [V] particle, or -1; empty: no tethers
  std::vector<T> tether_length;
  std::vector<int> order;  ///< constraint of each record (see Schedule)
  int max_patch_particles = 0;
};

template <class T>
PreparedCloth<T> prepare_cloth(const Cloth& cloth);

extern template PreparedCloth<float> prepare_cloth(const Cloth&);
extern template PreparedCloth<double> prepare_cloth(const Cloth&);

}  // namespace atelier
