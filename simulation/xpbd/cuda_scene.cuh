#pragma once

#include "simulation/contact/body_contact_math.h"
#include "simulation/contact/body_feature_math.h"
#include "simulation/contact/collision_response_math.h"
#include "simulation/xpbd/edge_math.h"
#include "simulation/xpbd/near_groups.h"
#include "simulation/xpbd/sweep_math.h"

namespace atelier {

/// Data that differ between the scenes of one launch.
template <class T>
struct CudaSceneRule {
  T spring_softness, hinge_softness;
  T friction;
};

/// Counts of a scene's contacts with itself.
struct SelfCounts {
  int face_pairs, edge_pairs, crossings;  ///< in the lists, or that would be
  int pushes;                             ///< in the first pass of the last substep
  int searches, renewals;                 ///< of all pairs, of a part
  int most;                               ///< room that the longest lists of the frame needed
  int stale;                              ///< pass in which a particle had left its flight
  int left;                               ///< how many have new flights for that
  int pressed;                            ///< pass after which another is needed
  int kept;                               ///< pass that kept something back
  int passed;                             ///< pass that let something pass, or kept it back
};

/// A particle, an edge or a face, with the particles that it has; who has fewer repeats the last.
struct alignas(16) GroupedItem {
  int a, b, c;
  int index;
};

/// Boxes over primitives, over groups of kGroup and, where those are many, over groups of kGroup
/// groups (near_groups.h): arrays of scene 0, those of the others follow. What a last group lacks
/// has an empty box.
template <class T>
struct BoxGroups {
  const GroupedItem* item;  ///< [count] in the order of the groups
  int count;
  Box<T>* box;      ///< [groups][kGroup]
  Box<T>* group;    ///< [groups]
  Box<T>* whole;    ///< [wholes]
  unsigned* fresh;  ///< [groups] which primitives' pairs are looked for, a bit each
  bool many;        ///< too many groups to look through all of them: `whole` comes first

  static __host__ __device__ int parts(int n) { return (n + kGroup - 1) / kGroup; }
  __host__ __device__ int groups() const { return parts(count); }
  __host__ __device__ int wholes() const { return parts(groups()); }
};

/// Contact of the cloth with itself: arrays of scene 0, those of the others follow.
template <class T>
struct CudaSelfFrame {
  SelfView<T> cloth;
  SelfRule<T> rule;
  T gap_share;     ///< of their gap that pushes leave pairs
  Vec4<T>* start;  ///< of `cloth`
  Vec4<T>* end;
  int* tangled;
  T* slack;
  int* flown;                            ///< number of the search that gave a particle its flight
  int* stirred;                          ///< last substep of the frame in which contacts moved a
                                         ///< particle or it passed something, from 1
  BoxGroups<T> particles, edges, faces;  ///< of flights, with their search margin
  BoxGroups<T> edges_now, faces_now;     ///< where the substep began
  ResponseSum* sums;                     ///< [particles], or null: no contact with itself
  Vec4<T>* origin;                       ///< where the substep began
  Vec4<T>* carry;                        ///< see SelfParticle
  int* emerges;                          ///< of particles: 1 comes out of the body in this frame
  int* support;                          ///< levels of particles, see ResponseSum
  SelfPair<T>* face_pairs;               ///< [scenes][room]
  SelfPair<T>* edge_pairs;
  int2* crossings;  ///< edge, face
  int room;
  SelfCounts* counts;

  __host__ __device__ int edge_room() const { return 3 * room; }
  __host__ __device__ int crossing_room() const { return room / 4; }
  __host__ __device__ static int room_for(int faces, int edges, int crossings) {
    const int a = faces > (edges + 2) / 3 ? faces : (edges + 2) / 3;
    return a > 4 * crossings ? a : 4 * crossings;
  }
};

/// Contact with the sharp features of the body (body_feature_math.h).
template <class T>
struct CudaFeatureFrame {
  SelfView<T> cloth;
  BodyFeatures<T> features;
  FeatureRule<T> rule;
  const int* edge_of;  ///< of the cloth, see push_off_face
  const T* length;
  const int* any;     ///< 1: the frame has something sharp
  int face_count;     ///< of the cloth; 0: none of this
  int* near;          ///< [scenes][faces] 1: may meet something sharp in the frame
  int* near_faces;    ///< [scenes][faces] those that may, in any order
  int* near_count;    ///< [scenes]
  int* pushed;        ///< [particles] 1: a feature did in this iteration
  int* pressed;       ///< [scenes] number of the last pass after which another was needed, from 1
  ResponseSum* sums;  ///< [particles]
};

/// Contacts with the body of a solver that has impulses for them: the passes after its solution
/// keep out alone what went through in spite of them.
template <class T>
struct CudaImpulses {
  const Vec4<T>* of;        ///< [particles] N s; null: there are none, contacts are these passes
  BodyContactRule<T> rule;  ///< for particles that cloth keeps back; `body_rule` is the guard's
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
  const Places* edges;
  const EdgeRule<T>* edge_rules;
  const Places* strain_places;
  const StrainRest<T>* strains;
  int edge_count, strain_count;
  const int* tether_anchor;  ///< null: none
  const T* tether_length;

  Vec4<T>* x;
  Vec4<T>* start;
  Vec4<T>* velocity;
  const Vec4<T>* air;          ///< accelerations, or null
  const Vec4<T>* target;       ///< of fixed particles
  EdgeMultipliers<T>* lambda;  ///< null: 1 iteration, nobody asks
  T* strain_lambda;
  Vec4<T>* held;  ///< null where a substep has one contact pass
  const CudaSceneRule<T>* rules;
  Vec4<T>* frame_start;  ///< positions and velocities at the start of the frame, written in its
                         ///< first substep
  Vec4<T>* frame_velocity;

  Vec3<T> gravity;
  int substeps, iterations;
  int first_substep, last_substep;  ///< of this launch, [first, last)
  int resident;                     ///< 1: the plans of all that a block works on stay on chip
  int records_on_chip;              ///< 1: their edges too
  T frame_time;
  T h, damping, keep;
  int max_patch_particles;
  int keeps_starts;  ///< 1: starts of the substep stay on chip with the positions (damping,
                     ///< contact)

  BodyView<T> body;
  BodyContactRule<T> body_rule;
  BodyOutlook<T>* outlook;  ///< [particles]; gaps are renewed
  const int* candidates;
  int* touched;       ///< [particles] 1: touched the body in the last substep
  int* touch_counts;  ///< [scenes][4] and
  int* touch_items;   ///< [scenes][2][particles]: see TouchLists

  CudaImpulses<T> impulses;
  CudaFeatureFrame<T> features;
  CudaSelfFrame<T> self;

  unsigned* arrived;  ///< two counters per scene for the grid barrier: blocks come, blocks gone
  int* bad;           ///< smallest index of a particle that is not finite
};

}  // namespace atelier
