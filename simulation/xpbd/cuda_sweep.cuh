#pragma once

#include <cuda_pipeline.h>

#include "simulation/xpbd/cuda_scene.cuh"

namespace atelier {

/// Data of one patch for a block, laid out on chip: header, edges (where they fit), colours
/// and two more, particles.
struct PlanHeader {
  int vertex_begin, vertex_count, colour_count, first_edge;
  int edge_count, bytes, unused0, unused1;
};
template <class T>
int plan_size(int vertices, int colours, int edges) {
  const std::size_t bytes =
      sizeof(PlanHeader) +
      static_cast<std::size_t>(edges) * (sizeof(EdgeRule<T>) + sizeof(Places)) +
      static_cast<std::size_t>(colours + 2) * sizeof(PreparedColour) +
      static_cast<std::size_t>(vertices) * sizeof(int);
  return static_cast<int>((bytes + 31) / 32 * 32);
}
template <class T>
struct Plan {
  PlanHeader* header;
  EdgeRule<T>* rules;
  Places* places;
  PreparedColour* colours;
  int* particles;

  __device__ Plan(unsigned char* at, int colour_count, int edges_on_chip)
      : header(reinterpret_cast<PlanHeader*>(at)),
        rules(reinterpret_cast<EdgeRule<T>*>(at + sizeof(PlanHeader))),
        places(reinterpret_cast<Places*>(rules + edges_on_chip)),
        colours(reinterpret_cast<PreparedColour*>(places + edges_on_chip)),
        particles(reinterpret_cast<int*>(colours + colour_count + 2)) {}
  __device__ Plan(unsigned char* at, bool edges_on_chip)
      : Plan(at, reinterpret_cast<PlanHeader*>(at)->colour_count,
             edges_on_chip ? reinterpret_cast<PlanHeader*>(at)->edge_count : 0) {}
};

template <class T>
__device__ inline void copy_on_chip(T* to, const T* from, int count) {
  constexpr int kPiece = sizeof(T) % 16 == 0 ? 16 : sizeof(T);
  const int pieces = count * static_cast<int>(sizeof(T) / kPiece);
  for (int i = static_cast<int>(threadIdx.x); i < pieces; i += static_cast<int>(blockDim.x)) {
    __pipeline_memcpy_async(reinterpret_cast<unsigned char*>(to) + i * kPiece,
                            reinterpret_cast<const unsigned char*>(from) + i * kPiece, kPiece);
  }
}

/// Sets the plan of a patch on its way on chip, by all threads of the block; it is there after
/// wait_for_plans. Returns its bytes.
template <class T>
__device__ inline int load_plan(const CudaFrame<T>& frame, const Schedule::Patch& patch,
                                unsigned char* at) {
  const int colour_count = patch.colour_end - patch.colour_begin;
  const int vertex_count = patch.vertex_end - patch.vertex_begin;
  const PreparedColour last = frame.colours[patch.colour_end];
  const int first = frame.colours[patch.colour_begin].edge_begin;
  const int count = last.edge_begin - first;
  const int on_chip = frame.records_on_chip != 0 ? count : 0;
  const Plan<T> plan(at, colour_count, on_chip);
  const int used =
      static_cast<int>(reinterpret_cast<unsigned char*>(plan.particles + vertex_count) - at);
  const int bytes = (used + 31) / 32 * 32;
  if (threadIdx.x == 0) {
    *plan.header = {patch.vertex_begin, vertex_count, colour_count, first, count, bytes, 0, 0};
    plan.colours[colour_count + 1] = last;
  }
  copy_on_chip(plan.rules, frame.edge_rules + first, on_chip);
  copy_on_chip(plan.places, frame.edges + first, on_chip);
  copy_on_chip(plan.colours, frame.colours + patch.colour_begin, colour_count + 1);
  copy_on_chip(plan.particles, frame.patch_particles + patch.vertex_begin, vertex_count);
  return bytes;
}

__device__ inline void wait_for_plans() {
  __pipeline_commit();
  __pipeline_wait_prior(0);
  __syncthreads();
}

/// An edge as a thread works on it; `edge` is below 0 where it has none.
template <class T>
struct EdgeItem {
  int edge;
  uint2 places;  ///< as they lie in memory: two to a word
  EdgeRule<T> rule;
  EdgeMultipliers<T> lambda;
};

/// Where a thread finds its edges of a patch: on chip or in memory.
template <class T>
struct EdgeSource {
  const Places* places;
  const EdgeRule<T>* rules;
  const EdgeMultipliers<T>* lambda;  ///< null in a first iteration
  int offset;

  __device__ EdgeSource(const CudaFrame<T>& frame, const Plan<T>& plan, const PlanHeader& header,
                        const EdgeMultipliers<T>* multipliers)
      : lambda(multipliers) {
    const bool on_chip = frame.records_on_chip != 0;
    offset = on_chip ? header.first_edge : 0;
    places = on_chip ? plan.places : frame.edges;
    rules = on_chip ? plan.rules : frame.edge_rules;
  }

  __device__ EdgeItem<T> fetch(int begin, int end) const {
    EdgeItem<T> item;
    item.edge = begin + static_cast<int>(threadIdx.x);
    if (item.edge < end) {
      item.places = reinterpret_cast<const uint2*>(places)[item.edge - offset];
      item.rule = rules[item.edge - offset];
      item.lambda = lambda != nullptr ? lambda[item.edge] : EdgeMultipliers<T>{};
    } else {
      item.edge = -1;
    }
    return item;
  }
};

__device__ inline Places unpacked(uint2 places) {
  return {
      {static_cast<std::uint16_t>(places.x & 0xFFFFu), static_cast<std::uint16_t>(places.x >> 16),
       static_cast<std::uint16_t>(places.y & 0xFFFFu), static_cast<std::uint16_t>(places.y >> 16)}};
}

/// A patch that is swept: its colours and two more, its particles on chip and its multipliers.
template <class T>
struct SweptPatch {
  const PreparedColour* colours;
  int colour_count;
  Vec4<T>* x;
  const Vec4<T>* start;
  EdgeMultipliers<T>* lambda;  ///< null: nobody asks for them
  T* strain_lambda;            ///< likewise
  bool first_iteration;        ///< there are no multipliers yet
};

/// Constraints of a patch, colour after colour. A thread's edge of a colour is fetched while it
/// works on the colour before, so that its way from memory is hidden; `first` is that of the first
/// colour.
template <class T, bool kStrains>
__device__ inline void sweep_patch(const CudaFrame<T>& frame, const SweptPatch<T>& patch,
                                   const EdgeSource<T>& source, EdgeItem<T> first,
                                   const SubstepScale<T>& scale) {
  const PreparedColour* const colours = patch.colours;
  const int tid = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x);
  EdgeItem<T> item = first;
  int next_begin = colours[1].edge_begin;
#pragma unroll 1
  for (int k = 0; k < patch.colour_count; ++k) {
    const int next_end = colours[k + 2].edge_begin;
    const EdgeItem<T> next = source.fetch(next_begin, next_end);
    if (item.edge >= 0) {
      project_edge(unpacked(item.places), item.rule, patch.x, patch.start, item.lambda, scale);
      if (patch.lambda != nullptr) {
        patch.lambda[item.edge] = item.lambda;
      }
    }
    item = next;
    next_begin = next_end;
    if constexpr (kStrains) {
      for (int t = colours[k].strain_begin + tid; t < colours[k + 1].strain_begin; t += threads) {
        T values[3] = {T(0), T(0), T(0)};
        if (!patch.first_iteration) {
          for (int c = 0; c < 3; ++c) {
            values[c] = patch.strain_lambda[3 * t + c];
          }
        }
        project_triangle(frame.strain_places[t], frame.strains[t], patch.x, patch.start, values,
                         scale);
        if (patch.strain_lambda != nullptr) {
          for (int c = 0; c < 3; ++c) {
            patch.strain_lambda[3 * t + c] = values[c];
          }
        }
      }
    }
    __syncthreads();
  }
}

}  // namespace atelier
