#include "simulation/self_contact_cpu.h"

#include <algorithm>
#include <atomic>

#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kGrain = 256;

void add_to(int& sum, int value) {
  std::atomic_ref<int>(sum).fetch_add(value, std::memory_order_relaxed);
}

}  // namespace

template <class T>
SelfContactCpu<T>::SelfContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared,
                                  const XpbdOptions& options)
    : surface_(prepare_surface(cloth, prepared)), rule_(self_rule<T>(cloth, options)) {
  const std::size_t n = prepared.external.size();
  start_.resize(n);
  end_.resize(n);
  face_pairs_.resize(n);
  edge_pairs_.resize(surface_.edges.size());
  tangled_.resize(n);
  sums_.assign(n, PushSum{});
}

template <class T>
void SelfContactCpu<T>::begin_frame(const std::vector<Vec4<T>>& x,
                                    const std::vector<Vec3<T>>& velocity, T frame) {
  start_ = x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    end_[i] = with_w(xyz(x[i]) + frame * velocity[i], x[i].w);
  }
  view_.surface = {surface_.faces.data(), start_.data(), end_.data(), nullptr,
                   static_cast<int>(surface_.faces.size())};
  std::vector<Box<T>> boxes(surface_.faces.size());
  for (std::size_t f = 0; f < boxes.size(); ++f) {
    boxes[f] = swept_box(view_.surface, static_cast<int>(f));
  }
  refit_contact_tree(surface_.tree, boxes);
  view_.surface.nodes = surface_.tree.nodes.data();
  view_.edges = surface_.edges.data();
  view_.edge_count = static_cast<int>(surface_.edges.size());
  view_.face_edges = surface_.face_edges.data();
  view_.rest = surface_.rest.data();
  view_.layer = surface_.layer.empty() ? nullptr : surface_.layer.data();
  view_.tangled = tangled_.data();
  parallel_for(static_cast<Index>(x.size()), kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      face_pairs_[i] = collect_faces(view_, static_cast<int>(i), rule_);
    }
  });
  parallel_for(static_cast<Index>(edge_pairs_.size()), kGrain, [&](Index begin, Index end) {
    for (Index e = begin; e < end; ++e) {
      edge_pairs_[e] = collect_edges(view_, static_cast<int>(e), rule_);
    }
  });
  std::fill(tangled_.begin(), tangled_.end(), 0);
  candidates_ = 0;
  lost_ = 0;
  for (const SelfPairs<T>& pairs : face_pairs_) {
    candidates_ += pairs.count;
    lost_ += pairs.found - pairs.count;
  }
  for (std::size_t e = 0; e < edge_pairs_.size(); ++e) {
    const EdgePairs<T>& pairs = edge_pairs_[e];
    candidates_ += pairs.edges.count;
    lost_ += pairs.edges.found - pairs.edges.count;
    for (int k = 0; k < pairs.crossing_count; ++k) {
      const FaceIndices f = surface_.faces[pairs.crossing[k]];
      for (int v : {surface_.edges[e].a, surface_.edges[e].b, f.a, f.b, f.c}) {
        tangled_[v] = 1;
      }
    }
  }
}

template <class T>
void SelfContactCpu<T>::solve(std::vector<Vec4<T>>& x, const std::vector<Vec4<T>>& start,
                              const std::vector<char>& touched) {
  const auto load = [&](int i) { return supported(x[i], touched[i] != 0); };
  const auto load_start = [&](int i) { return start[i]; };
  const auto add = [&](int i, Vec3<T> push) {
    add_to(sums_[i].x, to_units(push.x));
    add_to(sums_[i].y, to_units(push.y));
    add_to(sums_[i].z, to_units(push.z));
    add_to(sums_[i].count, 1);
  };
  active_ = 0;
  parallel_for(static_cast<Index>(x.size()), kGrain, [&](Index begin, Index end) {
    int active = 0;
    for (Index i = begin; i < end; ++i) {
      for (int k = 0; k < face_pairs_[i].count; ++k) {
        active += push_vertex_face(view_, static_cast<int>(i), face_pairs_[i].pair[k], rule_, load,
                                   load_start, add);
      }
    }
    add_to(active_, active);
  });
  parallel_for(static_cast<Index>(edge_pairs_.size()), kGrain, [&](Index begin, Index end) {
    int active = 0;
    for (Index e = begin; e < end; ++e) {
      const EdgePairs<T>& pairs = edge_pairs_[e];
      for (int k = 0; k < pairs.edges.count; ++k) {
        active += push_edge_edge(view_, static_cast<int>(e), pairs.edges.pair[k], rule_, load,
                                 load_start, add);
      }
      for (int k = 0; k < pairs.crossing_count; ++k) {
        active += pull_out(view_, static_cast<int>(e), pairs.crossing[k], rule_, load, add);
      }
    }
    add_to(active_, active);
  });
  parallel_for(static_cast<Index>(x.size()), 8 * kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      if (sums_[i].count > 0) {
        x[i] = with_w(xyz(x[i]) + mean_push<T>(sums_[i]), x[i].w);
        sums_[i] = {};
      }
    }
  });
}

template class SelfContactCpu<float>;
template class SelfContactCpu<double>;

}  // namespace atelier
