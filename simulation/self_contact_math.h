#pragma once

#include <cstdint>

#include "simulation/body_contact_math.h"

namespace atelier {

/// Contact of cloth with itself and between layers: vertex against triangle and edge against edge.
///
/// Pairs. A search lists every pair that may come nearer than its gap while each particle stays
/// within `slack` of a straight flight (the displacement bound of Chen et al. 2025, "Offset
/// geometric contact", measured from the flight and not from a point, so that cloth that is carried
/// along keeps its pairs). A particle that leaves it, or a list that has grown too old, makes a new
/// search: nothing is missed.
///
/// Pushes. In a substep a pair keeps the side on which it was at the substep's start, so that
/// however fast it moves it does not pass. Pairs are solved at once (Jacobi); a particle takes in
/// each direction the largest push and the largest against it. These are integers of 2^-30 m and
/// extremes, so their order does not matter and every run gives the same bits. A corner or an edge
/// pushes only where it is what lies nearest (the normal cones of the same paper): else the edges
/// of two flat sheets would lock like the teeth of a rack.
///
/// Passes. While pairs are still pressed together by what they did in the substep, pushes are
/// repeated; in the last passes those that would cross stay where the substep began. What is
/// crossed all the same is pulled apart along the gradient of the length of the intersection
/// (Volino and Magnenat-Thalmann 2006); layers know which side is outside.

/// An edge with its faces: `face[0]` owns it.
struct ClothEdge {
  int a, b;
  int face[2];      ///< -1: boundary
  int opposite[2];  ///< corner across in each face, -1: boundary
};

/// The cloth while a list of pairs holds: `surface.start` are the particles at its search,
/// `surface.end` where they fly.
template <class T>
struct SelfView {
  BodyView<T> surface;
  const ClothEdge* edges;
  int edge_count;
  const int* face_edges;  ///< [3 F] edges that a face owns, or -1
  const int* across;      ///< [3 F] corner beyond the edge from corner k to k + 1, or -1
  const int* ring_begin;  ///< [V + 1] into `ring`
  const int* ring;        ///< neighbours of each particle
  const Vec4<T>* rest;    ///< template positions: sheets that lie close there may stay close
  const int* layer;       ///< of particles, or null
  const int* tangled;     ///< of particles: 1 where a piece around it is crossed
};

template <class T>
struct SelfRule {
  T thickness;  ///< m
  T friction;
  T old_overlap;  ///< m per substep at most off an overlap that was there before
  T slack;        ///< m, by which a particle may leave its flight before a new search
  T untangle;     ///< m per substep by which crossed pieces are pulled
  int horizon;    ///< substeps for which a search looks ahead
};

constexpr int kSelfPushes = 10;     ///< passes of pushes in a substep, at most
constexpr int kSelfPasses = 24;     ///< and of keeping back what would cross
constexpr double kSelfRest = 0.02;  ///< of the gap: a push below it needs no further pass
constexpr int kSelfCrossings = 2;   ///< faces that an edge passes through
constexpr int kSupportLevels = 64;  ///< of particles that rest on one another, see PushSum

/// A pair that may meet: particle (or edge) and face (or edge), and the gap that it keeps.
template <class T>
struct SelfPair {
  int first, second;
  T gap;
};

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> flight(const SelfView<T>& cloth, int i) {
  return xyz(cloth.surface.end[i]) - xyz(cloth.surface.start[i]);
}

template <class T>
ATELIER_HOST_DEVICE inline bool same_layer(const SelfView<T>& cloth, int first, int second) {
  return cloth.layer == nullptr || cloth.layer[first] == cloth.layer[second];
}

/// Calls `found(pair)` for every face that particle `i` may meet.
template <class T, class Found>
ATELIER_HOST_DEVICE inline void collect_faces(const SelfView<T>& cloth, int i,
                                              const SelfRule<T>& rule, const Found& found) {
  const Vec3<T> x = xyz(cloth.surface.start[i]);
  const Vec3<T> v = flight(cloth, i);
  Box<T> box{x, x};
  grow(box, x + v);
  const T reach = rule.thickness + T(2) * rule.slack;
  visit_tree(cloth.surface.nodes, inflated(box, reach), [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    if (f.a == i || f.b == i || f.c == i) {
      return;
    }
    const FaceCorners<T> t = corners_at(cloth.surface, face, T(0));
    const T squared = squared_norm(x - weighted(t, nearest_on_triangle(x, t)));
    const T motion =
        max_of(squared_norm(v - flight(cloth, f.a)),
               max_of(squared_norm(v - flight(cloth, f.b)), squared_norm(v - flight(cloth, f.c))));
    const T near = reach + std::sqrt(motion);
    if (squared > near * near) {
      return;
    }
    const FaceCorners<T> r{xyz(cloth.rest[f.a]), xyz(cloth.rest[f.b]), xyz(cloth.rest[f.c])};
    const Vec3<T> p = xyz(cloth.rest[i]);
    const T apart = same_layer(cloth, i, f.a)
                        ? T(0.9) * norm(p - weighted(r, nearest_on_triangle(p, r)))
                        : rule.thickness;
    found(SelfPair<T>{i, face, min_of(rule.thickness, apart)});
  });
}

/// Shares along two segments of their nearest points (Ericson 2005, 5.1.9).
template <class T>
struct SegmentShares {
  T s, t;
};
template <class T>
ATELIER_HOST_DEVICE inline SegmentShares<T> nearest_on_segments(Vec3<T> p1, Vec3<T> q1, Vec3<T> p2,
                                                                Vec3<T> q2) {
  const auto clamp = [](T v) { return v < T(0) ? T(0) : v > T(1) ? T(1) : v; };
  const Vec3<T> d1 = q1 - p1;
  const Vec3<T> d2 = q2 - p2;
  const Vec3<T> r = p1 - p2;
  const T a = dot(d1, d1);
  const T e = dot(d2, d2);
  const T f = dot(d2, r);
  const T c = dot(d1, r);
  const T b = dot(d1, d2);
  const T denominator = a * e - b * b;
  if (!(a > T(0)) || !(e > T(0))) {
    return {T(0), T(0)};
  }
  T s = denominator > T(1e-6) * a * e ? clamp((b * f - c * e) / denominator) : T(0.5);
  T t = (b * s + f) / e;
  if (t < T(0)) {
    t = T(0);
    s = clamp(-c / a);
  } else if (t > T(1)) {
    t = T(1);
    s = clamp((b - c) / a);
  }
  return {s, t};
}

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> between(Vec3<T> a, Vec3<T> b, T share) {
  return a + share * (b - a);
}

/// True if the segment p q passes through the triangle.
template <class T>
ATELIER_HOST_DEVICE inline bool crosses(Vec3<T> p, Vec3<T> q, const FaceCorners<T>& t) {
  const auto volume = [](Vec3<T> a, Vec3<T> b, Vec3<T> c, Vec3<T> d) {
    return dot(cross(b - a, c - a), d - a);
  };
  const T at_p = volume(t.a, t.b, t.c, p);
  const T at_q = volume(t.a, t.b, t.c, q);
  if (!((at_p > T(0) && at_q < T(0)) || (at_p < T(0) && at_q > T(0)))) {
    return false;
  }
  const T ab = volume(p, q, t.a, t.b);
  const T bc = volume(p, q, t.b, t.c);
  const T ca = volume(p, q, t.c, t.a);
  return (ab > T(0) && bc > T(0) && ca > T(0)) || (ab < T(0) && bc < T(0) && ca < T(0));
}

/// Calls `found(pair)` for every edge that edge `e` may meet (each pair once, by the lower index)
/// and `crossing(face)` for every face that it passes through now.
template <class T, class Found, class Crossing>
ATELIER_HOST_DEVICE inline void collect_edges(const SelfView<T>& cloth, int e,
                                              const SelfRule<T>& rule, const Found& found,
                                              const Crossing& crossing) {
  const ClothEdge edge = cloth.edges[e];
  const Vec3<T> p = xyz(cloth.surface.start[edge.a]);
  const Vec3<T> q = xyz(cloth.surface.start[edge.b]);
  const Vec3<T> vp = flight(cloth, edge.a);
  const Vec3<T> vq = flight(cloth, edge.b);
  Box<T> box{p, p};
  grow(box, q);
  grow(box, p + vp);
  grow(box, q + vq);
  const T reach = rule.thickness + T(2) * rule.slack;
  visit_tree(cloth.surface.nodes, inflated(box, reach), [&](int face) {
    const FaceIndices f = cloth.surface.faces[face];
    const bool a_in = f.a == edge.a || f.b == edge.a || f.c == edge.a;
    const bool b_in = f.a == edge.b || f.b == edge.b || f.c == edge.b;
    if (!a_in && !b_in && crosses(p, q, corners_at(cloth.surface, face, T(0)))) {
      crossing(face);
    }
    for (int k = 0; k < 3; ++k) {
      const int o = cloth.face_edges[3 * face + k];
      if (o <= e) {
        continue;
      }
      const ClothEdge other = cloth.edges[o];
      if (other.a == edge.a || other.a == edge.b || other.b == edge.a || other.b == edge.b) {
        continue;
      }
      const Vec3<T> r = xyz(cloth.surface.start[other.a]);
      const Vec3<T> s = xyz(cloth.surface.start[other.b]);
      const SegmentShares<T> near = nearest_on_segments(p, q, r, s);
      const T squared = squared_norm(between(p, q, near.s) - between(r, s, near.t));
      const Vec3<T> vr = flight(cloth, other.a);
      const Vec3<T> vs = flight(cloth, other.b);
      const T motion = max_of(max_of(squared_norm(vp - vr), squared_norm(vp - vs)),
                              max_of(squared_norm(vq - vr), squared_norm(vq - vs)));
      const T within = reach + std::sqrt(motion);
      if (squared > within * within) {
        continue;
      }
      T apart = rule.thickness;
      if (same_layer(cloth, edge.a, other.a)) {
        const Vec3<T> rp = xyz(cloth.rest[edge.a]);
        const Vec3<T> rq = xyz(cloth.rest[edge.b]);
        const Vec3<T> rr = xyz(cloth.rest[other.a]);
        const Vec3<T> rs = xyz(cloth.rest[other.b]);
        const SegmentShares<T> flat = nearest_on_segments(rp, rq, rr, rs);
        apart = T(0.9) * norm(between(rp, rq, flat.s) - between(rr, rs, flat.t));
      }
      found(SelfPair<T>{e, o, min_of(rule.thickness, apart)});
    }
  });
}

/// True if a particle left the flight of the list's search too far: `age` is the time since, 1 at
/// the list's end.
template <class T>
ATELIER_HOST_DEVICE inline bool left_flight(const SelfView<T>& cloth, int i, Vec3<T> x, T age,
                                            const SelfRule<T>& rule) {
  const Vec3<T> away = x - xyz(cloth.surface.start[i]) - age * flight(cloth, i);
  return squared_norm(away) > rule.slack * rule.slack;
}

/// Four particles of a pair with the weights of its two nearest points: their difference, first
/// minus second, is sum weight x. The first `split` particles are the first primitive's.
template <class T>
struct PairPoints {
  int particle[4];
  T weight[4];
  int split;
  Vec4<T> start[4];
  Vec4<T> x[4];
};

/// Fixed-point unit of the pushes.
constexpr double kPushUnit = 1.0 / (1 << 30);
template <class T>
ATELIER_HOST_DEVICE inline int to_units(T metres) {
  constexpr T kMost = T(1.5);  // what fits
  const T limited = metres > kMost ? kMost : metres < -kMost ? -kMost : metres;
  return static_cast<int>(std::floor(limited * static_cast<T>(1 << 30) + T(0.5)));
}

/// The largest pushes forwards and backwards along each axis, in units.
struct PushExtent {
  int high[3], low[3];
};
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> push_of(const PushExtent& extent) {
  const T unit = static_cast<T>(kPushUnit);
  return {unit * (static_cast<T>(extent.high[0]) + static_cast<T>(extent.low[0])),
          unit * (static_cast<T>(extent.high[1]) + static_cast<T>(extent.low[1])),
          unit * (static_cast<T>(extent.high[2]) + static_cast<T>(extent.low[2]))};
}

/// What pairs want of one particle; all zero: nothing. Extremes, so that their order does not
/// matter.
struct alignas(16) PushSum {
  PushExtent fresh;  ///< undoes what the substep did: becomes speed
  PushExtent calm;   ///< takes off what was there before: does not become speed
  int used;          ///< 1: a pair wrote here
  int stay;          ///< 1: the particle stays where the substep began
  int support;       ///< kSupportLevels less the level: 0 hangs free, the body holds level 0
};

/// Gives a particle what pairs want of it; `calm` adds up what is not to become speed.
template <class T>
ATELIER_HOST_DEVICE inline void take_push(const PushSum& sum, Vec4<T>& x, const Vec4<T>& start,
                                          Vec4<T>& calm) {
  if (sum.stay != 0) {
    x = with_w(xyz(start), x.w);
    calm = Vec4<T>{};
    return;
  }
  const Vec3<T> off = push_of<T>(sum.calm);
  x = with_w(xyz(x) + push_of<T>(sum.fresh) + off, x.w);
  calm = with_w(xyz(calm) + off, calm.w);
}

/// How a pair was found, by what it did in the substep.
enum class PairState {
  Apart,    ///< nothing to do
  Touches,  ///< pushed
  Presses   ///< pushed far, nearly through or through: it has to be looked at again
};

/// Keeps a pair apart by `gap` along the direction it had at the substep's start; `normal` where it
/// had none. `outwards` is 0, or the unit direction in which the first must lie (layers). Who
/// rests on the body, on others too, hardly yields to who does not: else what lies on it would push
/// it through (shock propagation, Guendelman et al. 2003).
template <class T, class Support, class Add>
ATELIER_HOST_DEVICE inline PairState push_apart(const PairPoints<T>& pair, Vec3<T> normal,
                                                Vec3<T> outwards, T gap, const SelfRule<T>& rule,
                                                const Support& support, const Add& add) {
  Vec3<T> now{};
  Vec3<T> before{};
  for (int k = 0; k < 4; ++k) {
    now += pair.weight[k] * xyz(pair.x[k]);
    before += pair.weight[k] * xyz(pair.start[k]);
  }
  const T distance = norm(before);
  Vec3<T> n = distance > T(1e-7) ? (T(1) / distance) * before : normal;
  if (dot(n, outwards) < T(0)) {
    n = outwards;
  }
  const T at_start = dot(n, before);
  const T at_end = dot(n, now);
  const T wanted = min_of(gap, at_start + rule.old_overlap);
  if (!(at_end < wanted)) {
    return PairState::Apart;
  }
  const T fresh = max_of(T(0), min_of(wanted, at_start) - at_end);
  const T calm = wanted - at_end - fresh;
  const Vec3<T> slip = (now - before) - dot(now - before, n) * n;
  const T size = norm(slip);
  const T most = rule.friction * fresh;
  const Vec3<T> hold = size > most ? (-most / size) * slip : -slip;

  int level[4];
  int best[2] = {0, 0};
  for (int k = 0; k < 4; ++k) {
    level[k] = support(pair.particle[k]);
    const int side = k < pair.split ? 0 : 1;
    best[side] = level[k] > best[side] ? level[k] : best[side];
  }
  T yields[4];
  T part[2] = {T(0), T(0)};  // how much of the way each side goes
  for (int k = 0; k < 4; ++k) {
    const int side = k < pair.split ? 0 : 1;
    yields[k] = pair.weight[k] * (level[k] > best[1 - side] ? T(0.02) : T(1)) * pair.x[k].w;
    part[side] += pair.weight[k] * yields[k];
  }
  const T weight = part[0] + part[1];
  if (!(weight > T(0))) {
    return PairState::Apart;
  }
  for (int k = 0; k < 4; ++k) {
    const int side = k < pair.split ? 0 : 1;
    const int other = best[1 - side];
    // No particle goes further than its side has to: else overshoot would grow from layer to layer.
    const T most_share = part[side] / weight;
    const T share = max_of(-most_share, min_of(most_share, yields[k] / weight));
    add(pair.particle[k], share * (fresh * n + hold), (share * calm) * n,
        other > level[k] ? other - 1 : 0);
  }
  const bool presses = at_start > T(0) && (fresh > T(kSelfRest) * gap || at_end < T(0.05) * gap);
  return presses ? PairState::Presses : PairState::Touches;
}

/// True if `corner`, seen from the point `at` on an edge or corner, lies clearly further along
/// `direction` (not unit): then the piece of cloth towards it is what lies nearest, not the edge.
template <class T>
ATELIER_HOST_DEVICE inline bool leans_towards(Vec3<T> direction, Vec3<T> at, Vec3<T> corner) {
  const Vec3<T> d = corner - at;
  const T along = dot(direction, d);
  constexpr T kTilt = T(0.1);
  return along > T(0) && along * along > kTilt * kTilt * squared_norm(direction) * squared_norm(d);
}

/// Whether the point `at` (barycentric `b`) of a face is what its neighbourhood offers nearest to a
/// particle in `direction`.
template <class T, class LoadStart>
ATELIER_HOST_DEVICE inline bool is_nearest_piece(const SelfView<T>& cloth, int face, Vec3<T> b,
                                                 Vec3<T> at, Vec3<T> direction,
                                                 const LoadStart& load_start) {
  if (b.x > T(0) && b.y > T(0) && b.z > T(0)) {
    return true;
  }
  const FaceIndices f = cloth.surface.faces[face];
  const int only = b.x >= T(1) ? f.a : b.y >= T(1) ? f.b : b.z >= T(1) ? f.c : -1;
  if (only >= 0) {
    for (int k = cloth.ring_begin[only]; k < cloth.ring_begin[only + 1]; ++k) {
      if (leans_towards(direction, at, xyz(load_start(cloth.ring[k])))) {
        return false;
      }
    }
    return true;
  }
  const int edge = b.z <= T(0) ? 0 : b.x <= T(0) ? 1 : 2;
  const int beyond = cloth.across[3 * face + edge];
  return beyond < 0 || !leans_towards(direction, at, xyz(load_start(beyond)));
}

/// Six times the volume that four particles span at `share` of the substep.
template <class T>
ATELIER_HOST_DEVICE inline T spanned_volume(const Vec4<T>* start, const Vec4<T>* x, T share,
                                            Vec3<T>* at) {
  for (int k = 0; k < 4; ++k) {
    at[k] = between(xyz(start[k]), xyz(x[k]), share);
  }
  return dot(cross(at[1] - at[0], at[2] - at[0]), at[3] - at[0]);
}

/// True if the four particles come into one plane between start and end, changing sides; `at` is
/// then where they meet. The cubic is solved by bisection and regula falsi in turns between its
/// signs; passing and coming back within one substep leaves nothing crossed.
template <class T>
ATELIER_HOST_DEVICE inline bool becomes_flat(const Vec4<T>* start, const Vec4<T>* x, Vec3<T>* at) {
  T low = T(0);
  T high = T(1);
  T at_low = spanned_volume(start, x, low, at);
  T at_high = spanned_volume(start, x, high, at);
  if (!((at_low > T(0) && at_high < T(0)) || (at_low < T(0) && at_high > T(0)))) {
    return false;
  }
  for (int i = 0; i < 8; ++i) {
    const T time =
        i % 2 == 0 ? low + (high - low) * (at_low / (at_low - at_high)) : T(0.5) * (low + high);
    const T value = spanned_volume(start, x, time, at);
    if ((value > T(0)) == (at_low > T(0))) {
      low = time;
      at_low = value;
    } else {
      high = time;
      at_high = value;
    }
    if (!(std::fabs(at_low - at_high) > T(0))) {
      break;
    }
  }
  spanned_volume(start, x, T(0.5) * (low + high), at);
  return true;
}

/// True if a pair passes through itself in the substep: a particle (last of four, the face before
/// it) or, where `edges`, two edges.
template <class T>
ATELIER_HOST_DEVICE inline bool passes(const Vec4<T>* start, const Vec4<T>* x, bool edges) {
  Vec3<T> at[4];
  if (!becomes_flat(start, x, at)) {
    return false;
  }
  const T room = T(1e-3);
  if (!edges) {
    const Vec3<T> n = cross(at[1] - at[0], at[2] - at[0]);
    const T nn = squared_norm(n);
    if (!(nn > T(0))) {
      return false;
    }
    const T v = dot(n, cross(at[3] - at[0], at[2] - at[0])) / nn;
    const T w = dot(n, cross(at[1] - at[0], at[3] - at[0])) / nn;
    return v > -room && w > -room && v + w < T(1) + room;
  }
  // In their plane: both ends of each lie on different sides of the other.
  const Vec3<T> d1 = at[1] - at[0];
  const Vec3<T> d2 = at[3] - at[2];
  const Vec3<T> n = cross(d1, d2);
  const T nn = squared_norm(n);
  if (!(nn > T(1e-6) * squared_norm(d1) * squared_norm(d2))) {
    return false;
  }
  const Vec3<T> r = at[2] - at[0];
  const T s = dot(cross(r, d2), n) / nn;
  const T t = dot(cross(r, d1), n) / nn;
  return s > -room && s < T(1) + room && t > -room && t < T(1) + room;
}

/// The four particles of a pair, a face's first.
template <class T>
ATELIER_HOST_DEVICE inline void pair_particles(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                               bool edges, int* particle) {
  if (edges) {
    const ClothEdge a = cloth.edges[pair.first];
    const ClothEdge b = cloth.edges[pair.second];
    particle[0] = a.a;
    particle[1] = a.b;
    particle[2] = b.a;
    particle[3] = b.b;
  } else {
    const FaceIndices f = cloth.surface.faces[pair.second];
    particle[0] = f.a;
    particle[1] = f.b;
    particle[2] = f.c;
    particle[3] = pair.first;
  }
}

/// Direction in which the first point of a pair between layers must lie, seen from the face.
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> layer_direction(const SelfView<T>& cloth, int first, int second,
                                                   Vec3<T> normal) {
  if (same_layer(cloth, first, second)) {
    return {};
  }
  return cloth.layer[first] > cloth.layer[second] ? normal : -normal;
}

/// Normal of a face at the substep's start.
template <class T, class LoadStart>
ATELIER_HOST_DEVICE inline Vec3<T> start_normal(const SelfView<T>& cloth, int face,
                                                const LoadStart& load_start) {
  const FaceIndices f = cloth.surface.faces[face];
  const Vec3<T> a = xyz(load_start(f.a));
  const Vec3<T> n = cross(xyz(load_start(f.b)) - a, xyz(load_start(f.c)) - a);
  const T size = norm(n);
  return size > T(0) ? (T(1) / size) * n : n;
}

/// True if a pair is on the wrong side, as far as one can know, and may pass: pieces that are
/// crossed, layers in the wrong order. `before` is the pair's difference at the substep's start.
template <class T, class LoadStart>
ATELIER_HOST_DEVICE inline bool may_change_sides(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                                 bool edges, Vec3<T> before,
                                                 const LoadStart& load_start) {
  const auto tangled = [&](int i) { return cloth.tangled[i] != 0; };
  const ClothEdge b = edges ? cloth.edges[pair.second] : ClothEdge{};
  const int face = edges ? b.face[0] : pair.second;
  const int first = edges ? cloth.edges[pair.first].a : pair.first;
  const FaceIndices f = cloth.surface.faces[face];
  if (!same_layer(cloth, first, f.a)) {
    return dot(layer_direction(cloth, first, f.a, start_normal(cloth, face, load_start)), before) <
           T(0);
  }
  const bool first_tangled = tangled(first) || (edges && tangled(cloth.edges[pair.first].b));
  const bool second_tangled =
      edges ? tangled(b.a) || tangled(b.b) : tangled(f.a) || tangled(f.b) || tangled(f.c);
  return first_tangled && second_tangled;
}

/// Marks the particles of a pair that passes: `stay(particle)`.
template <class T, class Load, class LoadStart, class Stay>
ATELIER_HOST_DEVICE inline PairState keep_back(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                               bool edges, const Load& load,
                                               const LoadStart& load_start, const Stay& stay) {
  int particle[4];
  pair_particles(cloth, pair, edges, particle);
  Vec4<T> start[4];
  Vec4<T> x[4];
  for (int k = 0; k < 4; ++k) {
    start[k] = load_start(particle[k]);
    x[k] = load(particle[k]);
  }
  if (!passes(start, x, edges)) {
    return PairState::Apart;
  }
  Vec3<T> before{};
  if (edges) {
    const SegmentShares<T> near =
        nearest_on_segments(xyz(start[0]), xyz(start[1]), xyz(start[2]), xyz(start[3]));
    before = between(xyz(start[0]), xyz(start[1]), near.s) -
             between(xyz(start[2]), xyz(start[3]), near.t);
  } else {
    const FaceCorners<T> t{xyz(start[0]), xyz(start[1]), xyz(start[2])};
    before = xyz(start[3]) - weighted(t, nearest_on_triangle(xyz(start[3]), t));
  }
  if (may_change_sides(cloth, pair, edges, before, load_start)) {
    return PairState::Apart;
  }
  for (int k = 0; k < 4; ++k) {
    if (x[k].w > T(0)) {
      stay(particle[k]);
    }
  }
  return PairState::Presses;
}

/// True if some particle of a pair comes to the other primitive's side of the pair's direction
/// `before`: else it cannot have passed.
template <class T>
ATELIER_HOST_DEVICE inline bool may_pass(const PairPoints<T>& pair, Vec3<T> before) {
  T low = T(1e30);
  T high = T(-1e30);
  for (int k = 0; k < 4; ++k) {
    const T along = dot(before, xyz(pair.x[k]));
    if (k < pair.split) {
      low = min_of(low, along);
    } else {
      high = max_of(high, along);
    }
  }
  return !(low > high);
}

/// Pushes a particle and a face apart. `load(i)` and `load_start(i)` give particles now and at the
/// substep's start.
template <class T, class Load, class LoadStart, class Support, class Add>
ATELIER_HOST_DEVICE inline PairState push_vertex_face(const SelfView<T>& cloth,
                                                      const SelfPair<T>& candidate,
                                                      const SelfRule<T>& rule, const Load& load,
                                                      const LoadStart& load_start,
                                                      const Support& support, const Add& add) {
  const int i = candidate.first;
  const FaceIndices f = cloth.surface.faces[candidate.second];
  PairPoints<T> pair{{i, f.a, f.b, f.c}, {}, 1, {}, {}};
  for (int k = 0; k < 4; ++k) {
    pair.start[k] = load_start(pair.particle[k]);
    pair.x[k] = load(pair.particle[k]);
  }
  const FaceCorners<T> t{xyz(pair.start[1]), xyz(pair.start[2]), xyz(pair.start[3])};
  const Vec3<T> p = xyz(pair.start[0]);
  const Vec3<T> b = nearest_on_triangle(p, t);
  const Vec3<T> at = weighted(t, b);
  pair.weight[0] = T(1);
  pair.weight[1] = -b.x;
  pair.weight[2] = -b.y;
  pair.weight[3] = -b.z;
  Vec3<T> now{};
  for (int k = 0; k < 4; ++k) {
    now += pair.weight[k] * xyz(pair.x[k]);
  }
  const bool same = same_layer(cloth, i, f.a);
  const bool far = dot(now, p - at) >= candidate.gap * norm(p - at) && dot(now, p - at) > T(0);
  bool through = false;
  if (may_pass(pair, p - at)) {
    const Vec4<T> start[4] = {pair.start[1], pair.start[2], pair.start[3], pair.start[0]};
    const Vec4<T> end[4] = {pair.x[1], pair.x[2], pair.x[3], pair.x[0]};
    through = passes(start, end, false);
  }
  if (same && far && !through) {
    return PairState::Apart;
  }
  const bool free = may_change_sides(cloth, candidate, false, p - at, load_start);
  through = through && !free;
  if (same && (far || free)) {
    return through ? PairState::Presses : PairState::Apart;
  }
  if (!is_nearest_piece(cloth, candidate.second, b, at, p - at, load_start)) {
    return through ? PairState::Presses : PairState::Apart;
  }
  Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
  const T size = norm(normal);
  normal = size > T(0) ? (T(1) / size) * normal : normal;
  const PairState state = push_apart(pair, normal, layer_direction(cloth, i, f.a, normal),
                                     candidate.gap, rule, support, add);
  return through ? PairState::Presses : state;
}

/// Pushes two edges apart.
template <class T, class Load, class LoadStart, class Support, class Add>
ATELIER_HOST_DEVICE inline PairState push_edge_edge(const SelfView<T>& cloth,
                                                    const SelfPair<T>& candidate,
                                                    const SelfRule<T>& rule, const Load& load,
                                                    const LoadStart& load_start,
                                                    const Support& support, const Add& add) {
  const ClothEdge a = cloth.edges[candidate.first];
  const ClothEdge b = cloth.edges[candidate.second];
  PairPoints<T> pair{{a.a, a.b, b.a, b.b}, {}, 2, {}, {}};
  for (int k = 0; k < 4; ++k) {
    pair.start[k] = load_start(pair.particle[k]);
    pair.x[k] = load(pair.particle[k]);
  }
  const SegmentShares<T> near = nearest_on_segments(xyz(pair.start[0]), xyz(pair.start[1]),
                                                    xyz(pair.start[2]), xyz(pair.start[3]));
  pair.weight[0] = T(1) - near.s;
  pair.weight[1] = near.s;
  pair.weight[2] = near.t - T(1);
  pair.weight[3] = -near.t;
  const Vec3<T> on_a = between(xyz(pair.start[0]), xyz(pair.start[1]), near.s);
  const Vec3<T> on_b = between(xyz(pair.start[2]), xyz(pair.start[3]), near.t);
  const Vec3<T> before = on_a - on_b;
  Vec3<T> now{};
  for (int k = 0; k < 4; ++k) {
    now += pair.weight[k] * xyz(pair.x[k]);
  }
  const bool same = same_layer(cloth, a.a, b.a);
  const bool far = dot(now, before) >= candidate.gap * norm(before) && dot(now, before) > T(0);
  bool through = may_pass(pair, before) && passes(pair.start, pair.x, true);
  if (same && far && !through) {
    return PairState::Apart;
  }
  const bool free = may_change_sides(cloth, candidate, true, before, load_start);
  through = through && !free;
  if (same && (far || free)) {
    return through ? PairState::Presses : PairState::Apart;
  }
  // At an end it is the vertex that meets something, and its own pairs see to that.
  if (!(near.s > T(0) && near.s < T(1) && near.t > T(0) && near.t < T(1))) {
    return through ? PairState::Presses : PairState::Apart;
  }
  for (int k = 0; k < 2; ++k) {
    if ((a.face[k] >= 0 && leans_towards(-before, on_a, xyz(load_start(a.opposite[k])))) ||
        (b.face[k] >= 0 && leans_towards(before, on_b, xyz(load_start(b.opposite[k]))))) {
      return through ? PairState::Presses : PairState::Apart;
    }
  }
  Vec3<T> normal =
      cross(xyz(pair.start[1]) - xyz(pair.start[0]), xyz(pair.start[3]) - xyz(pair.start[2]));
  if (!same) {
    normal = start_normal(cloth, b.face[0], load_start);
  }
  const T size = norm(normal);
  normal = size > T(0) ? (T(1) / size) * normal : normal;
  const PairState state = push_apart(pair, normal, layer_direction(cloth, a.a, b.a, normal),
                                     candidate.gap, rule, support, add);
  return through ? PairState::Presses : state;
}

/// Pulls an edge out of a face that it passes through: along the gradient that shortens the line in
/// which its faces meet the other one. These pushes are calm.
template <class T, class Load, class Add>
ATELIER_HOST_DEVICE inline bool pull_out(const SelfView<T>& cloth, int e, int face,
                                         const SelfRule<T>& rule, const Load& load,
                                         const Add& add) {
  const ClothEdge edge = cloth.edges[e];
  const FaceIndices f = cloth.surface.faces[face];
  const Vec4<T> p4 = load(edge.a);
  const Vec4<T> q4 = load(edge.b);
  const Vec4<T> a4 = load(f.a);
  const Vec4<T> b4 = load(f.b);
  const Vec4<T> c4 = load(f.c);
  const Vec3<T> p = xyz(p4);
  const Vec3<T> q = xyz(q4);
  const FaceCorners<T> t{xyz(a4), xyz(b4), xyz(c4)};
  if (!crosses(p, q, t)) {
    return false;
  }
  Vec3<T> n = cross(t.b - t.a, t.c - t.a);
  const T nn = squared_norm(n);
  if (!(nn > T(0))) {
    return false;
  }
  n = (T(1) / std::sqrt(nn)) * n;
  const Vec3<T> along = q - p;
  const T length = norm(along);
  const Vec3<T> direction = (T(1) / length) * along;
  const T rise = dot(direction, n);
  Vec3<T> gradient{};
  for (int k = 0; k < 2; ++k) {
    if (edge.face[k] < 0) {
      continue;
    }
    const Vec3<T> inwards = xyz(load(edge.opposite[k])) - p;
    Vec3<T> line = cross(n, cross(along, inwards));
    const T size = norm(line);
    if (!(size > T(0))) {
      continue;
    }
    line = (T(1) / size) * line;
    if (dot(line, inwards - dot(inwards, direction) * direction) < T(0)) {
      line = -line;
    }
    gradient += line;
    if (std::fabs(rise) > T(0.05)) {
      gradient -= (dot(direction, line) / rise) * n;
    }
  }
  const T size = norm(gradient);
  if (!(size > T(1e-3))) {
    return false;
  }
  const Vec3<T> pull = (rule.untangle / size) * gradient;
  const T share = dot(n, t.a - p) / dot(n, along);
  const Vec3<T> none{};
  add(edge.a, none, (p4.w > T(0) ? (T(1) - share) : T(0)) * pull, 0);
  add(edge.b, none, (q4.w > T(0) ? share : T(0)) * pull, 0);
  const Vec3<T> back = T(-1.0 / 3) * pull;
  add(f.a, none, (a4.w > T(0) ? T(1) : T(0)) * back, 0);
  add(f.b, none, (b4.w > T(0) ? T(1) : T(0)) * back, 0);
  add(f.c, none, (c4.w > T(0) ? T(1) : T(0)) * back, 0);
  return true;
}

}  // namespace atelier
