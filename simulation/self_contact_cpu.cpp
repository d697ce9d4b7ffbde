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
  tree_now_ = surface_.tree;
  stirred_.assign(n, 0);
  fresh_.assign(n, 0);
  own_face_.assign(n, -1);
  for (std::size_t f = 0; f < surface_.faces.size(); ++f) {
    for (int v : {surface_.faces[f].a, surface_.faces[f].b, surface_.faces[f].c}) {
      own_face_[v] = static_cast<int>(f);
    }
  }
}

template <class T>
void SelfContactCpu<T>::begin_frame() {
  age_ = -1;
  frame_begins_ = true;
  searches_ = 0;
  renewals_ = 0;
  std::fill(support_.begin(), support_.end(), 0);
  std::fill(slack_.begin(), slack_.end(), rule_.slack);
}

template <class T>
void SelfContactCpu<T>::begin_substep(int left) {
  left_ = left;
  substep_begins_ = true;
  if (age_ >= 0 && ++age_ > ahead_) {
    age_ = -1;
  }
}

template <class T>
int SelfContactCpu<T>::renew_flights(const SelfMotion<T>& motion) {
  const Index n = static_cast<Index>(motion.x.size());
  const T age = static_cast<T>(age_) / static_cast<T>(ahead_);
  const auto count = [&](const auto& is) {
    return parallel_sum(n, 8 * kGrain, 0, [&](Index begin, Index end) {
      int sum = 0;
      for (Index i = begin; i < end; ++i) {
        sum += is(static_cast<int>(i)) ? 1 : 0;
      }
      return sum;
    });
  };
  if (count([&](int i) { return left_flight(view_, i, xyz(motion.x[i]), age, rule_); }) == 0) {
    return 0;
  }
  return count([&](int i) {
    fresh_[i] = renew_flight(age_, ahead_, xyz(motion.x[i]), xyz(motion.origin[i]), start_[i],
                             end_[i], slack_[i])
                    ? 1
                    : 0;
    return fresh_[i] != 0;
  });
}

template <class T>
void SelfContactCpu<T>::refit_tree() {
  std::vector<Box<T>> boxes(surface_.faces.size());
  parallel_for(static_cast<Index>(boxes.size()), 8 * kGrain, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      const T slack = face_slack(view_, surface_.faces[f], rule_);
      boxes[f] = inflated(flight_box(view_, surface_.faces[f]), search_margin(rule_, slack));
    }
  });
  refit_contact_tree(surface_.tree, boxes);
}

template <class T>
void SelfContactCpu<T>::search(const std::vector<Vec4<T>>& x, const std::vector<Vec4<T>>& origin) {
  age_ = 1;
  ahead_ = std::min(rule_.horizon, left_);
  view_.past = T(0);
  start_ = origin;
  for (std::size_t i = 0; i < x.size(); ++i) {
    end_[i] =
        with_w(xyz(origin[i]) + static_cast<T>(ahead_) * (xyz(x[i]) - xyz(origin[i])), x[i].w);
  }
  refit_tree();
  const auto put = [](std::vector<SelfPair<T>>& out) {
    return [&out](const SelfPair<T>& pair) { out.push_back(pair); };
  };
  gather(static_cast<Index>(x.size()), face_pairs_,
         [&](int i, std::vector<SelfPair<T>>& out) { collect_faces(view_, i, rule_, put(out)); });
  const Index edges = static_cast<Index>(surface_.edges.size());
  gather(edges, edge_pairs_, [&](int e, std::vector<SelfPair<T>>& out) {
    collect_edges(
        view_, e, rule_, [e](int o) { return o > e; }, put(out));
  });
}

template <class T>
void SelfContactCpu<T>::look_for_crossings(const std::vector<Vec4<T>>& origin) {
  const bool every = frame_begins_;
  const bool due = every || passed_ || !crossings_.empty();
  for (std::size_t i = 0; i < stirred_.size(); ++i) {
    stirred_[i] = due && (every || stirred_[i] != 0 || tangled_[i] != 0) ? 1 : 0;
  }
  frame_begins_ = false;
  passed_ = false;
  if (!due) {
    return;
  }
  const auto load = [&](int i) { return origin[i]; };
  std::vector<Box<T>> boxes(surface_.faces.size());
  parallel_for(static_cast<Index>(boxes.size()), 8 * kGrain, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      boxes[f] = box_at(surface_.faces[f], load);
    }
  });
  refit_contact_tree(tree_now_, boxes);
  const auto fresh_edge = [&](int e) {
    return stirred_[surface_.edges[e].a] != 0 || stirred_[surface_.edges[e].b] != 0;
  };
  const auto try_one = [&](int e, int f, std::vector<Crossing>& out) {
    const ClothEdge& edge = surface_.edges[e];
    const FaceIndices& face = surface_.faces[f];
    const auto has = [&](int v) { return face.a == v || face.b == v || face.c == v; };
    if (!has(edge.a) && !has(edge.b) && crosses_at(edge, face, load)) {
      out.push_back({e, f});
    }
  };
  gather(static_cast<Index>(surface_.edges.size()), crossings_,
         [&](int e, std::vector<Crossing>& out) {
           if (fresh_edge(e)) {
             visit_tree(tree_now_.nodes.data(), box_at(surface_.edges[e], load),
                        [&](int f) { try_one(e, f, out); });
           }
         });
  if (!every) {
    std::vector<Crossing> of_faces;
    gather(static_cast<Index>(surface_.faces.size()), of_faces,
           [&](int f, std::vector<Crossing>& out) {
             const FaceIndices& face = surface_.faces[f];
             if (stirred_[face.a] == 0 && stirred_[face.b] == 0 && stirred_[face.c] == 0) {
               return;
             }
             visit_tree(tree_now_.nodes.data(), boxes[f], [&](int other) {
               for (int k = 0; k < 3; ++k) {
                 const int e = surface_.face_edges[3 * other + k];
                 if (e >= 0 && !fresh_edge(e)) {
                   try_one(e, f, out);
                 }
               }
             });
           });
    crossings_.insert(crossings_.end(), of_faces.begin(), of_faces.end());
  }
  std::fill(stirred_.begin(), stirred_.end(), 0);
  std::fill(tangled_.begin(), tangled_.end(), 0);
  for (const Crossing& c : crossings_) {
    const FaceIndices face = surface_.faces[c.face];
    const ClothEdge& edge = surface_.edges[c.edge];
    for (int v : {edge.a, edge.b, face.a, face.b, face.c}) {
      tangled_[v] = 1;
    }
  }
}

template <class T>
void SelfContactCpu<T>::search_fresh() {
  view_.past = static_cast<T>(age_ - 1) / static_cast<T>(ahead_);
  refit_tree();
  const auto fresh_edge = [&](int e) {
    return fresh_[surface_.edges[e].a] != 0 || fresh_[surface_.edges[e].b] != 0;
  };
  const auto fresh_face = [&](int f) {
    const FaceIndices& face = surface_.faces[f];
    return fresh_[face.a] != 0 || fresh_[face.b] != 0 || fresh_[face.c] != 0;
  };
  const auto replace = [&](std::vector<SelfPair<T>>& pairs, bool edges,
                           const std::vector<SelfPair<T>>& found) {
    std::erase_if(pairs, [&](const SelfPair<T>& pair) {
      int particle[4];
      pair_particles(view_, pair, edges, particle);
      return fresh_[particle[0]] != 0 || fresh_[particle[1]] != 0 || fresh_[particle[2]] != 0 ||
             fresh_[particle[3]] != 0;
    });
    pairs.insert(pairs.end(), found.begin(), found.end());
  };
  std::vector<SelfPair<T>> found;
  gather(static_cast<Index>(surface_.edges.size()), found,
         [&](int e, std::vector<SelfPair<T>>& out) {
           if (fresh_edge(e)) {
             collect_edges(
                 view_, e, rule_, [&](int o) { return o > e || (o < e && !fresh_edge(o)); },
                 [&](const SelfPair<T>& pair) { out.push_back(pair); });
           }
         });
  replace(edge_pairs_, true, found);
  gather(static_cast<Index>(fresh_.size()), found, [&](int i, std::vector<SelfPair<T>>& out) {
    if (fresh_[i] != 0) {
      collect_faces(view_, i, rule_, [&](const SelfPair<T>& pair) { out.push_back(pair); });
    }
  });
  std::vector<SelfPair<T>> of_faces;
  gather(static_cast<Index>(surface_.faces.size()), of_faces,
         [&](int f, std::vector<SelfPair<T>>& out) {
           if (fresh_face(f)) {
             collect_particles(
                 view_, f, rule_,
                 [&](int i, int face) { return fresh_[i] == 0 && own_face_[i] == face; },
                 [&](const SelfPair<T>& pair) { out.push_back(pair); });
           }
         });
  found.insert(found.end(), of_faces.begin(), of_faces.end());
  replace(face_pairs_, false, found);
}

template <class T>
bool SelfContactCpu<T>::renew(const SelfMotion<T>& motion) {
  if (age_ >= 0) {
    const int left = renew_flights(motion);
    if (left == 0) {
      return false;
    }
    if (left <= static_cast<int>(fresh_.size()) / kSelfFew) {
      ++renewals_;
      search_fresh();
      return true;
    }
  }
  ++searches_;
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
  std::atomic<bool> passed{false};
  visit_pairs(pass, every, [&](const SelfPair<T>& pair, bool edges) {
    const Passing passing =
        atelier::keep_back(view_, pair, edges, slides, load, load_origin, carry, slide, stay);
    if (passing == Passing::No) {
      return;
    }
    passed.store(true, std::memory_order_relaxed);
    if (passing == Passing::Kept) {
      kept.store(true, std::memory_order_relaxed);
      return;
    }
    int particle[4];
    pair_particles(view_, pair, edges, particle);
    for (int i : particle) {
      raise_to(stirred_[i], 1);
    }
  });
  passed_ = passed_ || passed;
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
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    stirred_[i] |= moved_[i] != 0 ? 1 : 0;
  }
  if (substep_begins_) {
    substep_begins_ = false;
    look_for_crossings(motion.origin);
  }
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
