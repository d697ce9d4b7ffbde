#include "simulation/xpbd/feature_contact_cpu.h"

#include <algorithm>

#include "core/parallel.h"
#include "simulation/xpbd/response_sums.h"

namespace atelier {
namespace {

constexpr Index kFeatureGrain = 512;

}  // namespace

template <class T>
FeatureContactCpu<T>::FeatureContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared,
                                        const std::vector<FaceIndices>& body_faces)
    : surface_(prepare_surface(cloth, prepared)),
      edge_of_(edges_of_faces(surface_.faces, surface_.edges, false)),
      features_(prepare_features(body_faces)),
      length_(longest_edges(surface_)),
      longest_(*std::max_element(length_.begin(), length_.end())),
      min_edge_(features_.edges.size()),
      least_(body_faces.size()),
      sharp_(body_faces.size()),
      near_(surface_.faces.size()),
      sums_(prepared.external.size()) {
  SelfView<T>& view = step_.cloth;
  view.surface.faces = surface_.faces.data();
  view.surface.face_count = static_cast<int>(surface_.faces.size());
  view.edges = surface_.edges.data();
  view.edge_count = static_cast<int>(surface_.edges.size());
  view.across = surface_.across.data();
  view.ring_begin = surface_.ring_begin.data();
  view.ring = surface_.ring.data();
  step_.features = {features_.edges.data(),
                    features_.edge_of.data(),
                    features_.corner_of.data(),
                    features_.ring_begin.data(),
                    features_.ring.data(),
                    sharp_.data(),
                    least_.data(),
                    nullptr};
}

template <class T>
void FeatureContactCpu<T>::find_sharp(const Box<T>& around) {
  const BodyView<T>& body = step_.body;
  parallel_for(static_cast<Index>(min_edge_.size()), kFeatureGrain, [&](Index begin, Index end) {
    for (Index e = begin; e < end; ++e) {
      const ClothEdge& edge = features_.edges[e];
      Box<T> box = empty_box<T>();
      for (int v : {edge.a, edge.b}) {
        grow(box, xyz(body.start[v]));
        grow(box, xyz(body.end[v]));
      }
      min_edge_[e] =
          overlap(box, around) ? min_length_over(body, edge, T(2) * step_.rule.gap) : T(1e15);
    }
  });
  any_ =
      std::any_of(min_edge_.begin(), min_edge_.end(), [&](T least) { return least <= longest_; });
  if (!any_) {
    return;
  }
  std::vector<Box<T>> boxes(sharp_.size());
  parallel_for(static_cast<Index>(sharp_.size()), kFeatureGrain, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      const int face = static_cast<int>(f);
      const SharpOfFace<T> sharp = sharp_of_face(step_.features, face, min_edge_.data(), longest_);
      sharp_[f] = sharp.bits;
      least_[f] = sharp.least;
      boxes[f] = sharp.bits != 0 ? swept_box(body, face) : empty_box<T>();
    }
  });
  refit_contact_tree(tree_, boxes);
}

template <class T>
void FeatureContactCpu<T>::begin_frame(const BodyView<T>& body, const ContactTree<T>& tree,
                                       const BodyContactRule<T>& rule,
                                       const std::vector<Vec4<T>>& x,
                                       const std::vector<Vec3<T>>& flight,
                                       const std::vector<BodyOutlook<T>>& outlook) {
  step_.body = body;
  step_.rule = feature_rule(rule);
  frame_start_ = x;
  flight_ = flight;
  slack_.resize(x.size());
  left_.resize(x.size());
  Box<T> around = empty_box<T>();
  T most = T(0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    slack_[i] = outlook[i].slack;
    most = max_of(most, slack_[i]);
    grow(around, xyz(x[i]));
    grow(around, xyz(x[i]) + flight[i]);
  }
  if (tree_.nodes.empty()) {
    tree_ = tree;
  }
  step_.features.nodes = tree_.nodes.data();
  // Who leaves its flight by ten times what is expected is far beyond what a frame resolves.
  find_sharp(inflated(around, T(10) * most + step_.rule.within));
  parallel_for(static_cast<Index>(near_.size()), kFeatureGrain, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      near_[f] = 0;
      if (!any_) {
        continue;
      }
      const FaceIndices& face = surface_.faces[f];
      Box<T> box = empty_box<T>();
      T slack = T(0);
      for (int i : {face.a, face.b, face.c}) {
        grow(box, xyz(x[i]));
        grow(box, xyz(x[i]) + flight[i]);
        slack = max_of(slack, slack_[i]);
      }
      visit_tree(tree_.nodes.data(), inflated(box, slack + step_.rule.within),
                 [&](int k) { near_[f] |= static_cast<char>(length_[f] >= least_[k]); });
    }
  });
}

template <class T>
bool FeatureContactCpu<T>::find_left(const std::vector<Vec4<T>>& x, T t1) {
  const int count =
      parallel_sum(static_cast<Index>(x.size()), 4 * kFeatureGrain, 0, [&](Index begin, Index end) {
        int sum = 0;
        for (Index i = begin; i < end; ++i) {
          left_[i] = left_outlook(xyz(x[i]), xyz(frame_start_[i]), flight_[i], slack_[i], t1);
          sum += left_[i];
        }
        return sum;
      });
  return count > 0;
}

template <class T>
void FeatureContactCpu<T>::push(std::vector<Vec4<T>>& x, std::vector<Vec4<T>>& start, T t0, T t1,
                                std::vector<char>& touched) {
  if (!any_) {
    return;
  }
  step_.t0 = t0;
  step_.t1 = t1;
  active_.clear();
  const bool any_left = find_left(x, t1);
  for (int f = 0; f < static_cast<int>(near_.size()); ++f) {
    const FaceIndices& face = surface_.faces[f];
    if (near_[f] != 0 || (any_left && (left_[face.a] | left_[face.b] | left_[face.c]) != 0)) {
      active_.push_back(f);
    }
  }
  if (active_.empty()) {
    return;
  }
  const auto load = [&](int i) { return x[i]; };
  const auto load_start = [&](int i) { return start[i]; };
  const auto motion = motion_of(load, load_start);
  const PushedFaces<T> faces{edge_of_.data(), length_.data()};
  const auto add = [&](int i, Vec3<T> fresh, Vec3<T> calm, int level) {
    add_response(sums_[i], fresh, calm, level);
  };
  for (int pass = 0; pass < kFeaturePasses; ++pass) {
    std::atomic<bool> pressed{false};
    FeatureStep<T> step = step_;
    if (pass > 0) {  // old overlaps are worked at once a substep
      step.rule.push.old_overlap = T(0);
    }
    parallel_for(static_cast<Index>(active_.size()), 16, [&](Index begin, Index end) {
      for (Index k = begin; k < end; ++k) {
        const int f = active_[k];
        const FaceIndices& face = surface_.faces[f];
        Box<T> box = empty_box<T>();
        for (int i : {face.a, face.b, face.c}) {
          grow(box, xyz(start[i]));
          grow(box, xyz(x[i]));
        }
        visit_tree(tree_.nodes.data(), inflated(box, step.rule.within), [&](int body_face) {
          if (push_off_face(step, faces, f, body_face, motion, add, AloneInTree{}) ==
              PairState::Presses) {
            pressed.store(true, std::memory_order_relaxed);
          }
        });
      }
    });
    for (int f : active_) {
      const FaceIndices& face = surface_.faces[f];
      for (int i : {face.a, face.b, face.c}) {
        if (sums_[i].used != 0) {
          SelfParticle<T> p{x[i], start[i], {}};
          take_response(sums_[i], start[i], p);
          x[i] = p.x;
          start[i] = p.start;
          touched[i] = 1;
          sums_[i] = {};
        }
      }
    }
    if (!pressed) {
      return;
    }
  }
}

template class FeatureContactCpu<float>;
template class FeatureContactCpu<double>;

}  // namespace atelier
