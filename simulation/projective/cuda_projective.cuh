#pragma once

#include <cuda_fp16.h>

#include "core/cuda_buffer.cuh"
#include "simulation/projective/cloth_touch_math.h"
#include "simulation/projective/elastic_math.h"
#include "simulation/projective/inverse_factor.h"
#include "simulation/projective/velocity_bound_math.h"
#include "simulation/xpbd/cuda_scene.cuh"

namespace atelier {

/// Projective dynamics on the device (projective.h), in double precision but for the products that
/// solve an iteration, in float with a factor in half precision or float: what they round, the next
/// iteration mends. Particles are those of
/// PreparedCloth, unknowns the free ones in the order of InverseFactor.

/// What Anderson's acceleration (anderson_acceleration.h) remembers from one iteration to the next.
/// There are two, which iterations read and write by turns.
struct AndersonMemory {
  static constexpr int kMost = 20;  ///< iterations that are combined

  double products[kMost][kMost];  ///< of the differences of changes
  double least;                   ///< squared norm of the smallest change since the start
  int count;                      ///< differences known
  int newest;
  int first;  ///< 1: the last iteration is not one to take a difference to
};

/// Rows of W times a vector: up to kRowsAnItem rows of a part over up to kColumnsAnItem columns.
constexpr int kRowsAnItem = 8;
constexpr int kColumnsAnItem = 2048;
struct RowsItem {
  std::int64_t offset;  ///< of the first number
  int stride;
  int row, rows;
  int column, columns;
  int chunk;  ///< the how manieth of its rows
};

/// W^T times a vector: 32 columns from a multiple of 32 on, whichever parts they are of, and every
/// row that has numbers in them.
constexpr int kColumnsATile = 32;
struct ColumnsTile {
  int column, columns;
  int rows_begin, rows_end;
};
/// A row in a tile of columns.
struct TileRow {
  int row;
  int eight;                ///< its first eight numbers in the tile, of all eights in W
  unsigned char low, high;  ///< which eights of the tile it has
  unsigned short chunks;    ///< into which its products are cut
};

/// W on the device and how its products are shared out.
struct InverseView {
  const float* values;    ///< null: in half precision
  const __half* halves;   ///< null: in float
  const float* scale;     ///< [unknowns] of a row: its numbers are `scale` times what is stored
  const RowsItem* items;  ///< the longest first
  int long_items;         ///< of which each has a block; the others have a warp
  int items_count;
  const ColumnsTile* tiles;  ///< those of the most rows first
  int tiles_count;
  const TileRow* tile_rows;
};

/// The elastic rows (elastic_rows.h).
struct ElasticView {
  const ElasticRow* rows;
  const double* spring_rest;
  const double* bend_rest;
  const std::array<double, 3>* yarn_moduli;
  int bend_begin, yarn_begin;
  double damping;
  double longest;    ///< share of the rest length from which limits of stretch add
  const int* begin;  ///< [V + 1] entries of each particle
  const int* row;
  const double* weight;
};

/// A contact between pieces of cloth. All are solved at once: each sees of a particle's mass the
/// share that the number of its contacts leaves it (mass splitting, Tonge, Benevolenski and
/// Voroshilov 2012), so that together they do not overshoot.
struct ClothTouch {
  TouchedCloth bound;
  double mass;  ///< kg that resists along a direction
  int owner;    ///< which of its particles, from 0, keeps its impulse
};

/// Contacts between pieces of cloth in a substep, and for each particle those that it has a part
/// in, in an order that only depends on where the cloth is.
struct TouchesView {
  ClothTouch* touches;        ///< [room], null: no contact with itself
  Vec4<double>* impulses[2];  ///< [room] N s, which sweeps read and write by turns
  int* counts;                ///< [2] contacts, and entries that are given away
  int* begin;                 ///< [V] of a particle in `entries`
  int* degree;                ///< [V] how many it has; 0: fixed
  int* filled;                ///< [V]
  int* entries;               ///< [4 room] 4 touch + which of its particles
  int room;
  double friction;
  Vec4<double>* alone;       ///< [V] velocities without impulses
  Vec4<double>* reached[2];  ///< [V] and with them, by turns
};

/// Sweeps over contacts between pieces of cloth in an iteration.
constexpr int kTouchSweeps = 2;

/// Everything the steps of a frame need, by value to the kernels.
struct ProjectiveFrame {
  int count;     ///< particles
  int unknowns;  ///< free ones
  int substeps, iterations, window;
  double h, keep, friction, frame_time;
  Vec3d gravity;
  ElasticView elastic;
  InverseView inverse;

  const int* place;         ///< [V] of a particle among the unknowns, -1: fixed
  const int* particle;      ///< [unknowns]
  const double* mass;       ///< [V] kg
  const char* gentle;       ///< [V] 1: held gently by the body
  const Vec4<double>* air;  ///< accelerations, or null
  const Vec4<double>* target;
  const int* tether_anchor;  ///< null: none
  const double* tether_length;

  Vec4<double>* x;                  ///< w: inverse mass
  Vec4<double>* velocity;           ///< m/s
  const Vec4<double>* frame_start;  ///< where the frame began
  const Vec4<double>* frame_velocity;
  Vec4<double>* origin;  ///< at the substep's start
  Vec4<double>* start;   ///< the same, but for old overlaps
  Vec4<double>* wish;    ///< velocities without forces
  Vec4<double>* v;       ///< of the iteration
  Vec4<double>* at;      ///< where they lead to
  VelocityBound* bounds;
  Vec4<double>* impulses;  ///< N s
  VelocityBound* across;   ///< second contacts, with what lies across the first; null: no body
  Vec4<double>* across_impulses;  ///< N s
  int* touched;                   ///< null: no body
  Vec4<double>* self_origin;      ///< null: no contact with itself
  Vec4<double>* self_carry;
  TouchesView touches;

  // [unknowns]
  Vec4<float>* right;    ///< and a few zeros behind
  Vec4<float>* partial;  ///< [chunks][unknowns] products of rows
  Vec4<double>* change;
  Vec4<double>* last_change;
  Vec4<double>* last_next;
  Vec4<double>* of_change;  ///< [window][unknowns]
  Vec4<double>* of_next;
  double* dots;  ///< [1 + 2 window][tiles]
  AndersonMemory* memory;

  BodyView<double> body;
  BoundRules rules;
  BodyOutlook<double>* outlook;
  const int* candidates;
  int* bad;      ///< smallest index of a particle that is not finite
  int* pinched;  ///< 1 + the last substep with a second contact of a particle; 0: there was none
};

/// The steps of a substep, each one launch. `k` counts iterations.
void launch_projective_begin(const ProjectiveFrame& frame, int s, cudaStream_t stream);
void launch_projective_find(const ProjectiveFrame& frame, int s, cudaStream_t stream);
/// Second contacts of particles with a first one (BodyContacts::find_across), before iteration `k`.
void launch_projective_across(const ProjectiveFrame& frame, int s, int k, cudaStream_t stream);
/// `k`: the iteration, `j`: the sweep over contacts between pieces of cloth in it; `pinched`:
/// second contacts count.
void launch_projective_forces(const ProjectiveFrame& frame, int k, bool pinched,
                              cudaStream_t stream);
void launch_projective_hold(const ProjectiveFrame& frame, int k, int j, bool pinched,
                            cudaStream_t stream);
void launch_projective_rows(const ProjectiveFrame& frame, cudaStream_t stream);
void launch_projective_columns(const ProjectiveFrame& frame, int k, cudaStream_t stream);
void launch_projective_next(const ProjectiveFrame& frame, int k, cudaStream_t stream);
void launch_projective_leave(const ProjectiveFrame& frame, cudaStream_t stream);
void launch_projective_guard(const ProjectiveFrame& frame, int s, cudaStream_t stream);
void launch_projective_finish(const ProjectiveFrame& frame, cudaStream_t stream);

struct SelfClock;

/// What pieces of cloth may touch in substep `s`; `flight.x`: room for where they would go.
/// `clock`: one, on the device.
void launch_projective_touches(const CudaFrame<double>& flight, const ProjectiveFrame& frame, int s,
                               SelfClock* clock, cudaStream_t stream);
/// Body and cloth after the iterations, by the passes of XPBD.
void launch_projective_self(const CudaFrame<double>& frame, int s, SelfClock* clock,
                            cudaStream_t stream);
/// Bytes of the clock.
std::size_t projective_clock_size();

}  // namespace atelier
