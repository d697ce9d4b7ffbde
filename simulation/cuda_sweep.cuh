#pragma once

#include "simulation/cuda_scene.cuh"

namespace atelier {

/// What a block has to know of one patch, laid out on chip: header, edges (where they fit), colours
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

/// Brings the plan of a patch on chip: all threads of the block, who wait for each other
/// afterwards.
template <class T>
__device__ inline void load_plan(const CudaFrame<T>& frame, const Schedule::Patch& patch,
                                 unsigned char* at) {
  const int tid = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x);
  const int colour_count = patch.colour_end - patch.colour_begin;
  const int vertex_count = patch.vertex_end - patch.vertex_begin;
  const int first = frame.colours[patch.colour_begin].edge_begin;
  const int count = frame.colours[patch.colour_end].edge_begin - first;
  const int on_chip = frame.records_on_chip != 0 ? count : 0;
  const Plan<T> plan(at, colour_count, on_chip);
  if (tid == 0) {
    const int bytes =
        static_cast<int>(reinterpret_cast<unsigned char*>(plan.particles + vertex_count) - at);
    *plan.header = {
        patch.vertex_begin, vertex_count, colour_count, first, count, (bytes + 31) / 32 * 32, 0, 0};
  }
  for (int i = tid; i < on_chip; i += threads) {
    plan.rules[i] = frame.edge_rules[first + i];
    plan.places[i] = frame.edges[first + i];
  }
  for (int i = tid; i < colour_count + 2; i += threads) {
    plan.colours[i] = frame.colours[patch.colour_begin + min(i, colour_count)];
  }
  for (int i = tid; i < vertex_count; i += threads) {
    plan.particles[i] = frame.patch_particles[patch.vertex_begin + i];
  }
  __syncthreads();
}

/// An edge as a thread works on it; `edge` is below 0 where it has none.
template <class T>
struct EdgeItem {
  int edge;
  Places places;
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
      item.places = places[item.edge - offset];
      item.rule = rules[item.edge - offset];
      item.lambda = lambda != nullptr ? lambda[item.edge] : EdgeMultipliers<T>{};
    } else {
      item.edge = -1;
    }
    return item;
  }
};

/// Constraints of a patch, colour after colour. A thread's edge of a colour is fetched while it
/// works on the colour before, so that its way from memory is hidden; `first` is that of the first
/// colour.
template <class T, bool kStrains>
__device__ inline void sweep_patch(const CudaFrame<T>& frame, const PreparedColour* colours,
                                   int colour_count, const EdgeSource<T>& source, EdgeItem<T> first,
                                   Vec4<T>* x, const Vec4<T>* start, EdgeMultipliers<T>* lambda,
                                   T* strain_lambda, const SubstepScale<T>& scale,
                                   bool first_iteration) {
  const int tid = static_cast<int>(threadIdx.x);
  const int threads = static_cast<int>(blockDim.x);
  EdgeItem<T> item = first;
  int next_begin = colours[1].edge_begin;
#pragma unroll 1
  for (int k = 0; k < colour_count; ++k) {
    const int next_end = colours[k + 2].edge_begin;
    const EdgeItem<T> next = source.fetch(next_begin, next_end);
    if (item.edge >= 0) {
      project_edge(item.places, item.rule, x, start, item.lambda, scale);
      if (lambda != nullptr) {
        lambda[item.edge] = item.lambda;
      }
    }
    item = next;
    next_begin = next_end;
    if constexpr (kStrains) {
      for (int t = colours[k].strain_begin + tid; t < colours[k + 1].strain_begin; t += threads) {
        T values[3] = {T(0), T(0), T(0)};
        if (!first_iteration) {
          for (int c = 0; c < 3; ++c) {
            values[c] = strain_lambda[3 * t + c];
          }
        }
        project_triangle(frame.strain_places[t], frame.strains[t], x, start, values, scale);
        if (strain_lambda != nullptr) {
          for (int c = 0; c < 3; ++c) {
            strain_lambda[3 * t + c] = values[c];
          }
        }
      }
    }
    __syncthreads();
  }
}

}  // namespace atelier
