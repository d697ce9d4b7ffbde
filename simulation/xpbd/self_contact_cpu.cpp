#include "simulation/xpbd/self_contact_cpu.h"

#include <algorithm>
#include <atomic>

#include "core/parallel.h"
#include "simulation/contact/self_crossing_math.h"
#include "simulation/contact/self_search_math.h"
#include "simulation/xpbd/response_sums.h"

namespace atelier {
namespace {

constexpr Index kGrain = 256;

/// Runs `collect(i, out)` for every i and strings together what each wrote, in order. `grain`: so
/// many make a task.
template <class Item, class Collect>
void gather(Index count, Index grain, std::vector<Item>& out, const Collect& collect) {
  std::vector<std::vector<Item>> parts(static_cast<std::size_t>((count + grain - 1) / grain));
  parallel_for(static_cast<Index>(parts.size()), 1, [&](Index begin, Index end) {
    for (Index chunk = begin; chunk < end; ++chunk) {
      for (Index i = chunk * grain; i < std::min(count, (chunk + 1) * grain); ++i) {
        collect(static_cast<int>(i), parts[chunk]);
      }
    }
  });
  out.clear();
  for (const std::vector<Item>& part : parts) {
    out.insert(out.end(), part.begin(), part.end());
  }
}

/// True if what reaches `reach` (times `between`'s length) along `between` is further away than
/// `within`, give or take rounding.
template <class T>
bool stays_beyond(Vec3<T> between, T reach, T within) {
  const T squared = squared_norm(between);
  const T gap = squared - reach;
  const T bound = T(1.001) * within + T(1e-6);
  return gap > T(0) && gap * gap > bound * bound * squared;
}

bool has(const FaceIndices& face, int particle) {
  return face.a == particle || face.b == particle || face.c == particle;
}

}  // namespace

template <class T>
SelfContactCpu<T>::SelfContactCpu(const Cloth& cloth, const PreparedCloth<T>& prepared,
                                  const XpbdOptions& options)
    : surface_(prepare_surface(cloth, prepared)),
      rule_(self_rule<T>(cloth, options, (options.substeps + 1) / 2)),
      push_friction_(rule_.friction) {
  const std::size_t n = prepared.external.size();
  start_.resize(n);
  end_.resize(n);
  tangled_.resize(n);
  support_.resize(n);
  moved_.resize(n);
  sums_.assign(n, ResponseSum{});
  view_.surface = {surface_.faces.data(), start_.data(), end_.data(), nullptr,
                   static_cast<int>(surface_.faces.size())};
  view_.edges = surface_.edges.data();
  view_.edge_count = static_cast<int>(surface_.edges.size());
  view_.across = surface_.across.data();
  view_.ring_begin = surface_.ring_begin.data();
  view_.ring = surface_.ring.data();
  view_.rest = surface_.rest.data();
  view_.layer = surface_.layer.empty() ? nullptr : surface_.layer.data();
  view_.tangled = tangled_.data();
  slack_.assign(n, rule_.slack);
  view_.slack = slack_.data();
  stirred_.assign(n, 0);
  fresh_.assign(n, 0);
  std::vector<std::array<double, 3>> particles(n);
  std::vector<std::array<double, 3>> edges(surface_.edges.size());
  std::vector<std::array<double, 3>> faces(surface_.faces.size());
  const auto centre = [&](Vec3<T> sum) {
    return std::array<double, 3>{static_cast<double>(sum.x), static_cast<double>(sum.y),
                                 static_cast<double>(sum.z)};
  };
  const auto rest = [&](int i) { return xyz(surface_.rest[i]); };
  for (std::size_t i = 0; i < n; ++i) {
    particles[i] = centre(rest(static_cast<int>(i)));
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edges[e] = centre(rest(surface_.edges[e].a) + rest(surface_.edges[e].b));
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const FaceIndices& face = surface_.faces[f];
    faces[f] = centre(rest(face.a) + rest(face.b) + rest(face.c));
  }
  near_particles_ = GroupedBoxes(particles);
  near_edges_ = GroupedBoxes(edges);
  near_faces_ = GroupedBoxes(faces);
  edges_now_ = near_edges_;
  faces_now_ = near_faces_;
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
int SelfContactCpu<T>::renew_swept_bounds(const SelfMotion<T>& motion) {
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
  if (count([&](int i) { return left_swept_bound(view_, i, xyz(motion.x[i]), age, rule_); }) == 0) {
    return 0;
  }
  return count([&](int i) {
    fresh_[i] = renew_swept_bound({age_, ahead_}, xyz(motion.x[i]), xyz(motion.origin[i]),
                                  start_[i], end_[i], slack_[i])
                    ? 1
                    : 0;
    return fresh_[i] != 0;
  });
}

template <class T>
void SelfContactCpu<T>::search(const SelfMotion<T>& motion) {
  age_ = 1;
  ahead_ = std::min(rule_.horizon, left_);
  view_.past = T(0);
  parallel_for(std::ssize(start_), 8 * kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const Vec3<T> moved = xyz(motion.x[i]) - xyz(motion.origin[i]);
      start_[i] = motion.origin[i];
      end_[i] = with_w(xyz(motion.origin[i]) + static_cast<T>(ahead_) * moved, motion.x[i].w);
    }
  });
  near_edges_.fill([&](int e) { return swept_bound_with_margin(surface_.edges[e]); });
  near_faces_.fill([&](int f) { return swept_bound_with_margin(surface_.faces[f]); });
  near_particles_.fill([&](int i) { return swept_bound_with_margin(i); });
  const auto take_flights = [&](const GroupedBoxes& near, const auto& primitives, auto& flights) {
    flights.resize(primitives.size());
    parallel_for(near.count(), 8 * kGrain, [&](Index begin, Index end) {
      for (Index slot = begin; slot < end; ++slot) {
        flights[slot] = flight_of(primitives[near.item(static_cast<int>(slot))]);
      }
    });
  };
  take_flights(near_edges_, surface_.edges, edge_flights_);
  take_flights(near_faces_, surface_.faces, face_flights_);
  gather(near_edges_.groups(), 8, edge_pairs_, [&](int k, std::vector<SelfPair<T>>& out) {
    near_edges_.template visit_near_places<true>(k, near_edges_, [&](int e, int o) {
      if (!stay_apart(edge_flights_[e], edge_flights_[o])) {
        try_edges(near_edges_.item(e), near_edges_.item(o), out);
      }
    });
  });
  gather(near_particles_.groups(), 4, face_pairs_, [&](int k, std::vector<SelfPair<T>>& out) {
    near_particles_.template visit_near_places<false>(k, near_faces_, [&](int i, int f) {
      if (!stay_apart(near_particles_.item(i), face_flights_[f])) {
        try_face(near_particles_.item(i), near_faces_.item(f), out);
      }
    });
  });
}

template <class T>
auto SelfContactCpu<T>::flight_of(const ClothEdge& e) const -> EdgeFlight {
  const FlyingPoint<T> p = flying(view_, e.a);
  const FlyingPoint<T> q = flying(view_, e.b);
  return {T(0.5) * (p.at + q.at),
          T(0.5) * (q.at - p.at),
          T(0.5) * (p.on + q.on),
          T(0.5) * norm(q.on - p.on) + edge_slack(view_, e, rule_),
          e.a,
          e.b};
}

template <class T>
auto SelfContactCpu<T>::flight_of(const FaceIndices& f) const -> FaceFlight {
  const FlyingPoint<T> a = flying(view_, f.a);
  const FlyingPoint<T> b = flying(view_, f.b);
  const FlyingPoint<T> c = flying(view_, f.c);
  const T third = T(1) / T(3);
  const Vec3<T> middle = third * (a.at + b.at + c.at);
  const Vec3<T> on = third * (a.on + b.on + c.on);
  const T spread = std::max({norm(a.on - on), norm(b.on - on), norm(c.on - on)});
  return {middle, a.at - middle, b.at - middle, on, spread + face_slack(view_, f, rule_), f};
}

template <class T>
bool SelfContactCpu<T>::stay_apart(const EdgeFlight& p, const EdgeFlight& q) const {
  if (p.a == q.a || p.a == q.b || p.b == q.a || p.b == q.b) {
    return true;
  }
  const Vec3<T> between = q.middle - p.middle;
  const T reach = std::abs(dot(p.half, between)) + std::abs(dot(q.half, between));
  return stays_beyond(between, reach, rule_.thickness + p.margin + q.margin + norm(q.on - p.on));
}

template <class T>
bool SelfContactCpu<T>::stay_apart(int i, const FaceFlight& face) const {
  if (has(face.corner, i)) {
    return true;
  }
  const FlyingPoint<T> p = flying(view_, i);
  const Vec3<T> between = p.at - face.middle;
  const T first = dot(face.first, between);
  const T second = dot(face.second, between);
  const T reach = std::max({first, second, -first - second});
  return stays_beyond(
      between, reach,
      rule_.thickness + slack_of(view_, i, rule_) + face.margin + norm(p.on - face.on));
}

template <class T>
void SelfContactCpu<T>::look_for_crossings(const std::vector<Vec4<T>>& origin) {
  const bool every = frame_begins_;
  const bool due = every || passed_ || !crossings_.empty();
  frame_begins_ = false;
  passed_ = false;
  if (!due) {
    std::fill(stirred_.begin(), stirred_.end(), 0);
    return;
  }
  for (std::size_t i = 0; i < stirred_.size(); ++i) {
    stirred_[i] |= tangled_[i];
  }
  const auto load = [&](int i) { return origin[i]; };
  edges_now_.fill([&](int e) { return box_at(surface_.edges[e], load); });
  faces_now_.fill([&](int f) { return box_at(surface_.faces[f], load); });
  const auto try_crossing = [&](int e, int f, std::vector<Crossing>& out) {
    const ClothEdge& edge = surface_.edges[e];
    const FaceIndices& face = surface_.faces[f];
    if (!has(face, edge.a) && !has(face, edge.b) && crosses_at(edge, face, load)) {
      out.push_back({e, f});
    }
  };
  std::vector<Crossing> crossings;
  if (every) {
    gather(edges_now_.groups(), 8, crossings, [&](int k, std::vector<Crossing>& out) {
      edges_now_.visit_near<false>(k, faces_now_, [&](int e, int f) { try_crossing(e, f, out); });
    });
  } else {
    const auto stirred = [&](const auto&... particle) {
      return ((stirred_[particle] != 0) || ...);
    };
    const auto edge_is = [&](int e) { return stirred(surface_.edges[e].a, surface_.edges[e].b); };
    gather(static_cast<Index>(surface_.edges.size()), kGrain, crossings,
           [&](int e, std::vector<Crossing>& out) {
             if (edge_is(e)) {
               faces_now_.visit_near(box_at(surface_.edges[e], load),
                                     [&](int f) { try_crossing(e, f, out); });
             }
           });
    std::vector<Crossing> of_faces;
    gather(static_cast<Index>(surface_.faces.size()), kGrain, of_faces,
           [&](int f, std::vector<Crossing>& out) {
             const FaceIndices& face = surface_.faces[f];
             if (stirred(face.a, face.b, face.c)) {
               edges_now_.visit_near(box_at(face, load), [&](int e) {
                 if (!edge_is(e)) {
                   try_crossing(e, f, out);
                 }
               });
             }
           });
    crossings.insert(crossings.end(), of_faces.begin(), of_faces.end());
  }
  set_crossings(std::move(crossings));
  std::fill(stirred_.begin(), stirred_.end(), 0);
}

template <class T>
void SelfContactCpu<T>::set_crossings(std::vector<Crossing> crossings) {
  crossings_ = std::move(crossings);
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
  const auto fresh = [&](const auto&... particle) { return ((fresh_[particle] != 0) || ...); };
  const auto fresh_edge = [&](int e) { return fresh(surface_.edges[e].a, surface_.edges[e].b); };
  const auto fresh_face = [&](int f) {
    const FaceIndices& face = surface_.faces[f];
    return fresh(face.a, face.b, face.c);
  };
  near_edges_.fill_where(fresh_edge,
                         [&](int e) { return swept_bound_with_margin(surface_.edges[e]); });
  near_faces_.fill_where(fresh_face,
                         [&](int f) { return swept_bound_with_margin(surface_.faces[f]); });
  near_particles_.fill_where(fresh, [&](int i) { return swept_bound_with_margin(i); });
  const auto replace = [&](std::vector<SelfPair<T>>& pairs, bool edges,
                           const std::vector<SelfPair<T>>& found) {
    std::erase_if(pairs, [&](const SelfPair<T>& pair) {
      int particle[4];
      pair_particles(view_, pair, edges, particle);
      return fresh(particle[0], particle[1], particle[2], particle[3]);
    });
    pairs.insert(pairs.end(), found.begin(), found.end());
  };
  std::vector<SelfPair<T>> found;
  gather(static_cast<Index>(surface_.edges.size()), kGrain, found,
         [&](int e, std::vector<SelfPair<T>>& out) {
           if (fresh_edge(e)) {
             near_edges_.visit_near(swept_bound_with_margin(surface_.edges[e]), [&](int o) {
               if (o > e || (o < e && !fresh_edge(o))) {
                 try_edges(e, o, out);
               }
             });
           }
         });
  replace(edge_pairs_, true, found);
  gather(
      static_cast<Index>(fresh_.size()), kGrain, found, [&](int i, std::vector<SelfPair<T>>& out) {
        if (fresh(i)) {
          near_faces_.visit_near(swept_bound_with_margin(i), [&](int f) { try_face(i, f, out); });
        }
      });
  std::vector<SelfPair<T>> of_faces;
  gather(static_cast<Index>(surface_.faces.size()), kGrain, of_faces,
         [&](int f, std::vector<SelfPair<T>>& out) {
           if (fresh_face(f)) {
             near_particles_.visit_near(swept_bound_with_margin(surface_.faces[f]), [&](int i) {
               if (!fresh(i)) {
                 try_face(i, f, out);
               }
             });
           }
         });
  found.insert(found.end(), of_faces.begin(), of_faces.end());
  replace(face_pairs_, false, found);
}

template <class T>
void SelfContactCpu<T>::try_edges(int e, int o, std::vector<SelfPair<T>>& out) const {
  const ClothEdge& p = surface_.edges[e];
  const ClothEdge& q = surface_.edges[o];
  if (p.a != q.a && p.a != q.b && p.b != q.a && p.b != q.b) {
    offer_edge(view_, std::min(e, o), std::max(e, o), rule_,
               [&](const SelfPair<T>& pair) { out.push_back(pair); });
  }
}

template <class T>
void SelfContactCpu<T>::try_face(int i, int f, std::vector<SelfPair<T>>& out) const {
  if (!has(surface_.faces[f], i)) {
    offer_face(view_, i, f, rule_, [&](const SelfPair<T>& pair) { out.push_back(pair); });
  }
}

template <class T>
bool SelfContactCpu<T>::renew(const SelfMotion<T>& motion) {
  if (age_ >= 0) {
    const int left = renew_swept_bounds(motion);
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
  search(motion);
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
  rule.friction = push_friction_;
  if (pass > 0) {  // old overlaps and crossings are worked at once a substep
    rule.old_overlap = T(0);
    rule.untangle = T(0);
  }
  const auto load = [&](int i) { return motion.x[i]; };
  const auto load_origin = [&](int i) { return motion.origin[i]; };
  const auto from_origin = motion_of(load, load_origin);
  const auto support = [&](int i) { return support_[i]; };
  const auto add = [&](int i, Vec3<T> fresh, Vec3<T> calm, int level) {
    add_response(sums_[i], fresh, calm, level);
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
  visit_pairs(pass, every, [&](SelfPair<T> pair, bool edges) {
    pair.gap *= gap_share_;
    count(edges ? push_edge_edge(view_, pair, rule, from_origin, support, add)
                : push_vertex_face(view_, pair, rule, from_origin, support, add));
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
  const bool slides = pass < kSelfResponses + kSelfSlides;
  std::atomic<bool> kept{false};
  std::atomic<bool> passed{false};
  visit_pairs(pass, every, [&](const SelfPair<T>& pair, bool edges) {
    const Passing passing = atelier::keep_back(
        view_, pair, edges, slides, motion_of(load, load_origin), keeping_of(carry, slide, stay));
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
        take_response(sums_[i], motion.origin[i], p);
        motion.x[i] = p.x;
        motion.start[i] = p.start;
        motion.carry[i] = p.carry;
      }
    }
  });
}

template <class T>
void SelfContactCpu<T>::note_stirred_and_crossed(const std::vector<Vec4<T>>& origin) {
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    stirred_[i] |= moved_[i] != 0 ? 1 : 0;
  }
  if (substep_begins_) {
    substep_begins_ = false;
    look_for_crossings(origin);
  }
  std::fill(moved_.begin(), moved_.end(), 0);
}

template <class T>
const std::vector<SelfPair<T>>& SelfContactCpu<T>::near_faces(const SelfMotion<T>& motion) {
  note_stirred_and_crossed(motion.origin);
  renew(motion);
  return face_pairs_;
}

template <class T>
void SelfContactCpu<T>::push(const SelfMotion<T>& motion) {
  note_stirred_and_crossed(motion.origin);
  moved_from_ = 1;
  const auto support = [&](bool first) {
    parallel_for(std::ssize(sums_), 8 * kGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const int given = first ? support_[i] : sums_[i].support;
        support_[i] = motion.touched[i] != 0 ? kSupportLevels : given;
        sums_[i] = {};
      }
    });
  };
  support(true);
  for (int pass = 0; pass < kSelfResponses; ++pass) {
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
  moved_from_ = kSelfResponses + pass + 1;
  if (!keep_once(motion, kSelfResponses + pass, anew || pass == 0)) {
    return false;
  }
  take(motion, kSelfResponses + pass);
  std::fill(sums_.begin(), sums_.end(), ResponseSum{});
  return true;
}

template class SelfContactCpu<float>;
template class SelfContactCpu<double>;

}  // namespace atelier
