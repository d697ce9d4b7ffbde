#pragma once

#include <cooperative_groups.h>

#include "simulation/body_contact_math.h"
#include "simulation/prepared_cloth.h"
#include "simulation/self_contact_math.h"
#include "simulation/sweep_math.h"

namespace atelier {

/// How the blocks of one scene wait for each other between phases.
enum class CudaBarrier {
  Block,    ///< one block a scene: no other to wait for
  Cluster,  ///< up to 16 blocks on neighbouring multiprocessors
  Grid      ///< blocks anywhere (launched together), through a counter in memory
};

/// What differs between the scenes of one launch.
template <class T>
struct CudaSceneRule {
  T spring_softness, hinge_softness;
  T friction;
};

/// Everything a frame needs, by value to the kernel. Arrays of particles hold the scenes one after
/// the other.
template <class T>
struct CudaFrame {
  int count;  ///< particles of a scene
  int phase_count;
  const Schedule::Phase* phases;
  const Schedule::Patch* patches;
  const PreparedColour* colours;
  const int* patch_particles;
  const ConstraintRecord<T>* records;
  const StrainRest<T>* strains;
  int record_count, strain_count;
  const int* tether_anchor;  ///< null: none
  const T* tether_length;

  Vec4<T>* x;
  Vec4<T>* start;
  Vec4<T>* velocity;
  const Vec4<T>* air;     ///< accelerations, or null
  const Vec4<T>* target;  ///< of fixed particles
  T* lambda;              ///< null: 1 iteration, nobody asks
  T* strain_lambda;
  Vec4<T>* held;  ///< null where a substep has one contact pass
  const CudaSceneRule<T>* rules;

  Vec3<T> gravity;
  int substeps, iterations;
  int first_substep, last_substep;  ///< of this launch, [first, last)
  int resident;  ///< 1: all that a block works on stays on chip during the launch
  T frame_time;
  T h, gamma, keep;
  int max_patch_particles, max_colours;

  BodyView<T> body;
  BodyContactRule<T> body_rule;
  const Vec4<T>* frame_start;
  const Vec4<T>* frame_velocity;
  const BodyOutlook<T>* outlook;
  const int* candidates;
  int* touched;  ///< [particles] 1: touched the body in the last substep

  SelfView<T> self;  ///< of scene 0; particles and pairs of the others follow
  SelfRule<T> self_rule;
  PushSum* sums;  ///< [particles], or null: no contact with itself
  const int* face_pair_count;
  const SelfPair<T>* face_pairs;
  const int2* edge_pair_count;  ///< pairs, crossings
  const SelfPair<T>* edge_pairs;
  const int* crossings;
  int* self_counts;  ///< [4 scenes] pushes in the last substep, pairs, lost pairs, -

  unsigned* arrived;  ///< a counter per scene for the grid barrier
  int* bad;           ///< smallest index of a particle that is not finite
};

}  // namespace atelier
