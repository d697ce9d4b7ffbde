#include "simulation/self_contact_cpu.h"

#include <algorithm>
#include <atomic>

#include "core/parallel.h"
#include "simulation/self_crossing_math.h"
#include "simulation/self_search_math.h"

namespace atelier {
namespace {

constexpr Index kGrain = 256;

void raise_to(int& place, int value) {
  const std::atomic_ref<int> shared(place);
  int seen = shared.load(std::memory_order_relaxed);
  while (seen < value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

void lower_to(int& place, int value) {
  const std::atomic_ref<int> shared(place);
  int seen = shared.load(std::memory_order_relaxed);
  while (seen > value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

template <class T>
void widen(PushExtent& extent, Vec3<T> push) {
  const int units[3] = {to_units(push.x), to_units(push.y), to_units(push.z)};
  for (int k = 0; k < 3; ++k) {
    if (units[k] > 0) {
      raise_to(extent.high[k], units[k]);
    } else if (units[k] < 0) {
      lower_to(extent.low[k], units[k]);
    }
  }
}

/// Runs `collect(i, out)` for every i and strings together what each wrote, in order.
template <class Item, class Collect>
void gather(Index count, std::vector<Item>& out, const Collect& collect) {
  const Index chunks = (count + kGrain - 1) / kGrain;
  std::vector<std::vector<Item>> parts(static_cast<std::size_t>(chunks));
  parallel_for(chunks, 1, [&](Index begin, Index end) {
    for (Index chunk = begin; chunk < end; ++chunk) {
      for (Index i = chunk * kGrain; i < std::min(count, (chunk + 1) * kGrain); ++i) {
        collect(static_cast<int>(i), parts[chunk]);
      }
    }
  });
  out.clear();
  for (const std::vector<Item>& part : parts) {
    out.insert(out.end(), part.begin(), part.end());
  }
}

}  // namespace

template <class T>
SelfContactCpu<T>::SelfContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared,
                                  const XpbdOptions& options)
    : surface_(prepare_surface(cloth, prepared)), rule_(self_rule<T>(cloth, options)) {
  const std::size_t n = prepared.external.size();
  start_.resize(n);
  end_.resize(n);
  tangled_.resize(n);
  support_.resize(n);
  moved_.resize(n);
  sums_.assign(n, PushSum{});
  view_.surface = {surface_.faces.data(), start_.data(), end_.data(), surface_.tree.nodes.data(),
                   static_cast<int>(surface_.faces.size())};
  view_.edges = surface_.edges.data();
  view_.edge_count = static_cast<int>(surface_.edges.size());
  view_.face_edges = surface_.face_edges.data();
  view_.across = surface_.across.data();
  view_.ring_begin = surface_.ring_begin.data();
  view_.ring = surface_.ring.data();
  view_.rest = surface_.rest.data();
  view_.layer = surface_.layer.empty() ? nullptr : surface_.layer.data();
  view_.tangled = tangled_.data();
  slack_.assign(n, rule_.slack);
  view_.slack = slack_.data();
}

template <class T>
void SelfContactCpu<T>::begin_frame() {
  age_ = -1;
  searches_ = 0;
  std::fill(support_.begin(), support_.end(), 0);
  std::fill(slack_.begin(), slack_.end(), rule_.slack);
}

template <class T>
void SelfContactCpu<T>::begin_substep(int left) {
  left_ = left;
  if (age_ >= 0 && ++age_ > ahead_) {
    age_ = -1;
  }
}

template <class T>
bool SelfContactCpu<T>::holds(const std::vector<Vec4<T>>& x) const {
  if (age_ < 0) {
    return false;
  }
  const T age = static_cast<T>(age_) / static_cast<T>(ahead_);
  const int left =
      parallel_sum(static_cast<Index>(x.size()), 8 * kGrain, 0, [&](Index begin, Index end) {
        int count = 0;
        for (Index i = begin; i < end; ++i) {
          count += left_flight(view_, static_cast<int>(i), xyz(x[i]), age, rule_);
        }
        return count;
      });
  return left == 0;
}

template <class T>
void SelfContactCpu<T>::search(const std::vector<Vec4<T>>& x, const std::vector<Vec4<T>>& origin) {
  ++searches_;
  age_ = 1;
  ahead_ = std::min(rule_.horizon, left_);
  start_ = origin;
  for (std::size_t i = 0; i < x.size(); ++i) {
    end_[i] =
        with_w(xyz(origin[i]) + static_cast<T>(ahead_) * (xyz(x[i]) - xyz(origin[i])), x[i].w);
  }
  std::vector<Box<T>> boxes(surface_.faces.size());
  parallel_for(static_cast<Index>(boxes.size()), 8 * kGrain, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      const T slack = face_slack(view_, surface_.faces[f], rule_);
      boxes[f] =
          inflated(swept_box(view_.surface, static_cast<int>(f)), search_margin(rule_, slack));
    }
  });
  refit_contact_tree(surface_.tree, boxes);
  gather(static_cast<Index>(x.size()), face_pairs_, [&](int i, std::vector<SelfPair<T>>& out) {
    collect_faces(view_, i, rule_, [&](const SelfPair<T>& pair) { out.push_back(pair); });
  });
  struct Found {
    SelfPair<T> pair;
    bool crosses;
  };
  std::vector<Found> found;
  gather(static_cast<Index>(surface_.edges.size()), found, [&](int e, std::vector<Found>& out) {
    collect_edges(
        view_, e, rule_,
        [&](const SelfPair<T>& pair) {
          out.push_back({pair, false});
        },
        [&](int face) {
          out.push_back({{e, face, T(0)}, true});
        });
  });
  std::fill(tangled_.begin(), tangled_.end(), 0);
  edge_pairs_.clear();
  crossings_.clear();
  for (const Found& f : found) {
    if (!f.crosses) {
      edge_pairs_.push_back(f.pair);
      continue;
    }
    crossings_.push_back({f.pair.first, f.pair.second});
    const FaceIndices face = surface_.faces[f.pair.second];
    const ClothEdge& edge = surface_.edges[f.pair.first];
    for (int v : {edge.a, edge.b, face.a, face.b, face.c}) {
      tangled_[v] = 1;
    }
  }
}

template <class T>
void SelfContactCpu<T>::give_slack(const std::vector<Vec4<T>>& x) {
  if (age_ < 0) {
    return;  // the list is merely old
  }
  const T age = static_cast<T>(age_) / static_cast<T>(ahead_);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3<T> away = xyz(x[i]) - xyz(start_[i]) - age * flight(view_, static_cast<int>(i));
    const T distance = norm(away);
    slack_[i] = max_of(slack_[i], T(2) * distance);
  }
}

template <class T>
bool SelfContactCpu<T>::renew(const SelfMotion<T>& motion) {
  if (holds(motion.x)) {
    return false;
  }
  give_slack(motion.x);
  search(motion.x, motion.origin);
  return true;
}

template <class T>
template <class Work>
void SelfContactCpu<T>::visit_pairs(int pass, bool every, const Work& work) const {
  // A pair of which nothing moved since the last pass has nothing new to say.
  const auto stirred = [&](int i) { return moved_[i] == pass; };
  const auto visit = [&](const std::vector<SelfPair<T>>& list, bool edges) {
    parallel_for(static_cast<Index>(list.size()), 4 * kGrain, [&](Index begin, Index end) {
      for (Index k = begin; k < end; ++k) {
        int particle[4];
        pair_particles(view_, list[k], edges, particle);
        if (every || stirred(particle[0]) || stirred(particle[1]) || stirred(particle[2]) ||
            stirred(particle[3])) {
          work(list[k], edges);
        }
      }
    });
  };
  visit(face_pairs_, false);
  visit(edge_pairs_, true);
}

template <class T>
bool SelfContactCpu<T>::push_once(const SelfMotion<T>& motion, int pass, bool every) {
  SelfRule<T> rule = rule_;
  if (pass > 0) {  // old overlaps and crossings are worked at once a substep
    rule.old_overlap = T(0);
    rule.untangle = T(0);
  }
  const auto load = [&](int i) { return motion.x[i]; };
  const auto load_origin = [&](int i) { return motion.origin[i]; };
  const auto support = [&](int i) { return support_[i]; };
  const auto add = [&](int i, Vec3<T> fresh, Vec3<T> calm, int level) {
    raise_to(sums_[i].used, 1);
    widen(sums_[i].fresh, fresh);
    widen(sums_[i].calm, calm);
    raise_to(sums_[i].support, level);
  };
  std::atomic<int> active{0};
  std::atomic<bool> pressed{false};
  const auto count = [&](PairState state) {
    if (state != PairState::Apart) {
      active.fetch_add(1, std::memory_order_relaxed);
    }
    if (state == PairState::Presses) {
      pressed.store(true, std::memory_order_relaxed);
    }
  };
  visit_pairs(pass, every, [&](const SelfPair<T>& pair, bool edges) {
    count(edges ? push_edge_edge(view_, pair, rule, load, load_origin, support, add)
                : push_vertex_face(view_, pair, rule, load, load_origin, support, add));
  });
  if (pass == 0) {
    for (const Crossing& c : crossings_) {
      count(pull_out(view_, c.edge, c.face, rule, load, add) ? PairState::Touches
                                                             : PairState::Apart);
    }
    active_ = active;
  }
  return pressed;
}

template <class T>
bool SelfContactCpu<T>::keep_once(const SelfMotion<T>& motion, int pass, bool every) {
  const auto load = [&](int i) { return motion.x[i]; };
  const auto load_origin = [&](int i) { return motion.origin[i]; };
  const auto carry = [&](int i) { return motion.carry[i]; };
  const auto slide = [&](int i, Vec3<T> push) {
    raise_to(sums_[i].used, 1);
    widen(sums_[i].fresh, push);
  };
  const auto stay = [&](int i, Vec3<T> held) {
    raise_to(sums_[i].stay, 1);
    slide(i, held);
  };
  const bool slides = pass < kSelfPushes + kSelfSlides;
  std::atomic<bool> kept{false};
  visit_pairs(pass, every, [&](const SelfPair<T>& pair, bool edges) {
    if (atelier::keep_back(view_, pair, edges, slides, load, load_origin, carry, slide, stay)) {
      kept.store(true, std::memory_order_relaxed);
    }
  });
  return kept;
}

template <class T>
void SelfContactCpu<T>::take(const SelfMotion<T>& motion, int pass) {
  parallel_for(static_cast<Index>(motion.x.size()), 8 * kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      if (sums_[i].used != 0) {
        moved_[i] = static_cast<char>(pass + 1);
        SelfParticle<T> p{motion.x[i], motion.start[i], motion.carry[i]};
        take_push(sums_[i], motion.origin[i], p);
        motion.x[i] = p.x;
        motion.start[i] = p.start;
        motion.carry[i] = p.carry;
      }
    }
  });
}

template <class T>
void SelfContactCpu<T>::push(const SelfMotion<T>& motion) {
  std::fill(moved_.begin(), moved_.end(), 0);
  moved_from_ = 1;
  const auto support = [&](bool first) {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      const int given = first ? support_[i] : sums_[i].support;
      support_[i] = motion.touched[i] != 0 ? kSupportLevels : given;
      sums_[i] = {};
    }
  };
  support(true);
  for (int pass = 0; pass < kSelfPushes; ++pass) {
    const bool anew = renew(motion);
    const bool pressed = push_once(motion, pass, anew || pass == 0);
    take(motion, pass);
    support(false);
    if (!pressed) {
      break;
    }
  }
}

template <class T>
bool SelfContactCpu<T>::keep_back(const SelfMotion<T>& motion, int pass) {
  const bool anew = renew(motion);
  moved_from_ = kSelfPushes + pass + 1;
  if (!keep_once(motion, kSelfPushes + pass, anew || pass == 0)) {
    return false;
  }
  take(motion, kSelfPushes + pass);
  std::fill(sums_.begin(), sums_.end(), PushSum{});
  return true;
}

template class SelfContactCpu<float>;
template class SelfContactCpu<double>;

}  // namespace atelier
