#pragma once

#include "simulation/contact/self_contact_math.h"

namespace atelier {

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

/// Where particles are: `now(i)` in a substep, `before(i)` at its start. Refers to both.
template <class Now, class Before>
struct ParticleMotion {
  const Now& now;
  const Before& before;
};
template <class Now, class Before>
ATELIER_HOST_DEVICE inline ParticleMotion<Now, Before> motion_of(const Now& now,
                                                                 const Before& before) {
  return {now, before};
}

/// Fixed-point unit of the pushes.
constexpr double kResponseUnit = 1.0 / (1 << 30);
template <class T>
ATELIER_HOST_DEVICE inline int to_units(T metres) {
  constexpr T kMost = T(1.5);  // what fits: the cast needs no check
  const T limited = metres > kMost ? kMost : metres < -kMost ? -kMost : metres;
  return static_cast<int>(std::floor(limited * static_cast<T>(1 << 30) + T(0.5)));
}

/// The largest pushes forwards and backwards along each axis, in units.
struct ResponseExtent {
  int high[3], low[3];
};
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> push_of(const ResponseExtent& extent) {
  const T unit = static_cast<T>(kResponseUnit);
  return {unit * (static_cast<T>(extent.high[0]) + static_cast<T>(extent.low[0])),
          unit * (static_cast<T>(extent.high[1]) + static_cast<T>(extent.low[1])),
          unit * (static_cast<T>(extent.high[2]) + static_cast<T>(extent.low[2]))};
}

/// Responses that pairs request of one particle; all zero: none. Extremes, so that their order does
/// not matter.
struct alignas(16) ResponseSum {
  ResponseExtent fresh;  ///< undoes what the substep did: becomes speed; where it stays: its carry
  ResponseExtent calm;   ///< takes off what was there before: does not become speed
  int used;              ///< 1: a pair wrote here
  int stay;              ///< 1: the particle stays where the substep began, but for its carry
  int support;           ///< kSupportLevels less the level: 0 hangs free, the body holds level 0
};

/// A particle in a substep, as its pairs move it.
template <class T>
struct SelfParticle {
  Vec4<T> x;
  Vec4<T> start;  ///< from which the speed follows
  Vec4<T> carry;  ///< how the body or a pin moves what stays with it in the substep (xyz); w: 1
                  ///< where it comes out of the body
};

/// Gives a particle what pairs want of it. `origin`: where the substep began.
template <class T>
ATELIER_HOST_DEVICE inline void take_response(const ResponseSum& sum, const Vec4<T>& origin,
                                              SelfParticle<T>& p) {
  if (sum.stay != 0) {
    p.carry = with_w(push_of<T>(sum.fresh), p.carry.w);
    p.x = with_w(xyz(origin) + xyz(p.carry), p.x.w);
    p.start = with_w(xyz(origin), p.start.w);
    return;
  }
  const Vec3<T> off = push_of<T>(sum.calm);
  p.x = with_w(xyz(p.x) + push_of<T>(sum.fresh) + off, p.x.w);
  p.start = with_w(xyz(p.start) + off, p.start.w);
}

/// How a pair was found, by what it did in the substep.
enum class PairState {
  Apart,    ///< nothing to do
  Touches,  ///< pushed
  Presses   ///< pushed far or nearly through: it has to be looked at again
};

/// Which way a pair comes apart.
template <class T>
struct PairDirection {
  Vec3<T> normal;    ///< where it had no direction at the substep's start
  Vec3<T> outwards;  ///< unit, in which the first must lie; 0: on whichever side it is
};

/// Keeps a pair apart by `gap` along the direction it had at the substep's start. A particle that
/// rests on the body, or on others that do, hardly yields to one that does not, which would
/// otherwise push it through (shock propagation, Guendelman et al. 2003).
template <class T, class Support, class Add>
ATELIER_HOST_DEVICE inline PairState push_apart(const PairPoints<T>& pair,
                                                const PairDirection<T>& direction, T gap,
                                                const SelfRule<T>& rule, const Support& support,
                                                const Add& add) {
  Vec3<T> now{};
  Vec3<T> before{};
  for (int k = 0; k < 4; ++k) {
    now += pair.weight[k] * xyz(pair.x[k]);
    before += pair.weight[k] * xyz(pair.start[k]);
  }
  const T distance = norm(before);
  Vec3<T> n = distance > T(1e-7) ? (T(1) / distance) * before : direction.normal;
  if (dot(n, direction.outwards) < T(0)) {
    n = direction.outwards;
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
    const T max_share = part[side] / weight;
    const T share = max_of(-max_share, min_of(max_share, yields[k] / weight));
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

/// True if both pieces of a pair are crossed by something, with all of their particles: crossings
/// then wander from piece to piece, and do not spread to those beside them.
template <class T>
ATELIER_HOST_DEVICE inline bool both_tangled(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                             bool edges) {
  const auto tangled = [&](int i) { return cloth.tangled[i] != 0; };
  if (edges) {
    const ClothEdge a = cloth.edges[pair.first];
    const ClothEdge b = cloth.edges[pair.second];
    return tangled(a.a) && tangled(a.b) && tangled(b.a) && tangled(b.b);
  }
  const FaceIndices f = cloth.surface.faces[pair.second];
  return tangled(pair.first) && tangled(f.a) && tangled(f.b) && tangled(f.c);
}

/// True for a pair of two layers beside something crossed: their order says on which side they
/// belong. Elsewhere it is the one on which they are, as with cloth of one layer: a pile topples
/// and a hem turns up, and what nothing crosses may lie either way round.
template <class T>
ATELIER_HOST_DEVICE inline bool order_decides(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                              bool edges) {
  int particle[4];
  pair_particles(cloth, pair, edges, particle);
  if (same_layer(cloth, particle[0], particle[3])) {
    return false;
  }
  bool beside = false;
  for (int i : particle) {
    beside = beside || cloth.tangled[i] != 0;
  }
  return beside;
}

/// True if layers whose order decides lie the wrong way round at the substep's start, where
/// `before` is the pair's difference.
template <class T, class LoadStart>
ATELIER_HOST_DEVICE inline bool in_wrong_order(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                               bool edges, Vec3<T> before,
                                               const LoadStart& load_start) {
  if (!order_decides(cloth, pair, edges)) {
    return false;
  }
  const int face = edges ? cloth.edges[pair.second].face[0] : pair.second;
  const int first = edges ? cloth.edges[pair.first].a : pair.first;
  const Vec3<T> normal = start_normal(cloth, face, load_start);
  return dot(layer_direction(cloth, first, cloth.surface.faces[face].a, normal), before) < T(0);
}

/// True for a pair further apart than `gap` before and after a substep, on one side. Layers in the
/// wrong order push one another only within it: a list of pairs may hold more, or not.
template <class T>
ATELIER_HOST_DEVICE inline bool stays_beyond(Vec3<T> before, Vec3<T> now, T gap) {
  return dot(now, before) > T(0) && squared_norm(now) > gap * gap &&
         squared_norm(before) > gap * gap;
}

/// Sets the points of a particle and a face that may touch, and which way they come apart; false
/// where they do not touch, or something else lies nearer. `motion`: a ParticleMotion; `gap`: of
/// those further apart all the way nothing comes.
template <class T, class Motion>
ATELIER_HOST_DEVICE inline bool vertex_face_points(const SelfView<T>& cloth,
                                                   const SelfPair<T>& candidate, T gap,
                                                   const Motion& motion, PairPoints<T>& pair,
                                                   PairDirection<T>& direction) {
  const int i = candidate.first;
  const FaceIndices f = cloth.surface.faces[candidate.second];
  pair = {{i, f.a, f.b, f.c}, {}, 1, {}, {}};
  for (int k = 0; k < 4; ++k) {
    pair.start[k] = motion.before(pair.particle[k]);
    pair.x[k] = motion.now(pair.particle[k]);
  }
  const bool ordered = order_decides(cloth, candidate, false);
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
  const bool far = dot(now, p - at) >= gap * norm(p - at) && dot(now, p - at) > T(0);
  if (!ordered && (far || both_tangled(cloth, candidate, false))) {
    return false;
  }
  if (ordered && stays_beyond(p - at, now, gap)) {
    return false;
  }
  if (!is_nearest_piece(cloth, candidate.second, b, at, p - at, motion.before)) {
    return false;
  }
  Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
  const T size = norm(normal);
  normal = size > T(0) ? (T(1) / size) * normal : normal;
  const Vec3<T> outwards = ordered ? layer_direction(cloth, i, f.a, normal) : Vec3<T>{};
  direction = PairDirection<T>{normal, outwards};
  return true;
}

/// Pushes a particle and a face apart. `motion`: a ParticleMotion.
template <class T, class Motion, class Support, class Add>
ATELIER_HOST_DEVICE inline PairState push_vertex_face(const SelfView<T>& cloth,
                                                      const SelfPair<T>& candidate,
                                                      const SelfRule<T>& rule, const Motion& motion,
                                                      const Support& support, const Add& add) {
  PairPoints<T> pair;
  PairDirection<T> direction;
  return vertex_face_points(cloth, candidate, candidate.gap, motion, pair, direction)
             ? push_apart(pair, direction, candidate.gap, rule, support, add)
             : PairState::Apart;
}

/// Pushes two edges apart.
template <class T, class Motion, class Support, class Add>
ATELIER_HOST_DEVICE inline PairState push_edge_edge(const SelfView<T>& cloth,
                                                    const SelfPair<T>& candidate,
                                                    const SelfRule<T>& rule, const Motion& motion,
                                                    const Support& support, const Add& add) {
  const ClothEdge a = cloth.edges[candidate.first];
  const ClothEdge b = cloth.edges[candidate.second];
  PairPoints<T> pair{{a.a, a.b, b.a, b.b}, {}, 2, {}, {}};
  for (int k = 0; k < 4; ++k) {
    pair.start[k] = motion.before(pair.particle[k]);
  }
  const SegmentShares<T> near = nearest_on_segments(xyz(pair.start[0]), xyz(pair.start[1]),
                                                    xyz(pair.start[2]), xyz(pair.start[3]));
  // At an end it is the vertex that meets something, and its own pairs see to that. First, since
  // most pairs of a list are so.
  if (!(near.s > T(0) && near.s < T(1) && near.t > T(0) && near.t < T(1))) {
    return PairState::Apart;
  }
  for (int k = 0; k < 4; ++k) {
    pair.x[k] = motion.now(pair.particle[k]);
  }
  const bool ordered = order_decides(cloth, candidate, true);
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
  const bool far = dot(now, before) >= candidate.gap * norm(before) && dot(now, before) > T(0);
  if (!ordered && (far || both_tangled(cloth, candidate, true))) {
    return PairState::Apart;
  }
  if (ordered && stays_beyond(before, now, candidate.gap)) {
    return PairState::Apart;
  }
  for (int k = 0; k < 2; ++k) {
    if ((a.face[k] >= 0 && leans_towards(-before, on_a, xyz(motion.before(a.opposite[k])))) ||
        (b.face[k] >= 0 && leans_towards(before, on_b, xyz(motion.before(b.opposite[k]))))) {
      return PairState::Apart;
    }
  }
  Vec3<T> normal =
      cross(xyz(pair.start[1]) - xyz(pair.start[0]), xyz(pair.start[3]) - xyz(pair.start[2]));
  if (ordered) {
    normal = start_normal(cloth, b.face[0], motion.before);
  }
  const T size = norm(normal);
  normal = size > T(0) ? (T(1) / size) * normal : normal;
  const Vec3<T> outwards = ordered ? layer_direction(cloth, a.a, b.a, normal) : Vec3<T>{};
  return push_apart(pair, PairDirection<T>{normal, outwards}, candidate.gap, rule, support, add);
}

}  // namespace atelier
