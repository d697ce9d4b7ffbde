#pragma once

#include "simulation/contact/collision_response_math.h"

namespace atelier {

/// Six times the volume that four particles span at `share` of the substep.
template <class T>
ATELIER_HOST_DEVICE inline T spanned_volume(const Vec4<T>* start, const Vec4<T>* x, T share,
                                            Vec3<T>* at) {
  for (int k = 0; k < 4; ++k) {
    at[k] = between(xyz(start[k]), xyz(x[k]), share);
  }
  return dot(cross(at[1] - at[0], at[2] - at[0]), at[3] - at[0]);
}

/// The times between which the volume that four particles span changes one way only: `count` cuts
/// from 0 to 1, none where it does not come to 0.
template <class T>
struct VolumeCuts {
  T time[4], volume[4];
  int count;
};
template <class T>
ATELIER_HOST_DEVICE inline VolumeCuts<T> volume_cuts(const Vec4<T>* start, const Vec4<T>* x) {
  Vec3<T> at[4];
  T v[4];
  for (int k = 0; k < 4; ++k) {
    v[k] = spanned_volume(start, x, k == 3 ? T(1) : static_cast<T>(k) * T(1.0 / 3), at);
  }
  // The cubic through the four values lies between those of its Bernstein form.
  const T b1 = (T(-5) * v[0] + T(18) * v[1] - T(9) * v[2] + T(2) * v[3]) * T(1.0 / 6);
  const T b2 = (T(2) * v[0] - T(9) * v[1] + T(18) * v[2] - T(5) * v[3]) * T(1.0 / 6);
  VolumeCuts<T> cuts{{T(0)}, {v[0]}, 0};
  if ((v[0] > T(0) && b1 > T(0) && b2 > T(0) && v[3] > T(0)) ||
      (v[0] < T(0) && b1 < T(0) && b2 < T(0) && v[3] < T(0))) {
    return cuts;
  }
  cuts.count = 1;
  // Its derivative is d0 (1 - t)^2 + 2 d1 t (1 - t) + d2 t^2, up to a factor.
  const T d0 = b1 - v[0];
  const T d1 = b2 - b1;
  const T d2 = v[3] - b2;
  const T a = d0 - T(2) * d1 + d2;
  const T half = d1 - d0;
  const T root = half * half - a * d0;
  if (root > T(0)) {
    const T q = -(half + (half > T(0) ? std::sqrt(root) : -std::sqrt(root)));
    const T one = q / a;
    const T two = d0 / q;
    for (T time : {one < two ? one : two, one < two ? two : one}) {
      if (time > cuts.time[cuts.count - 1] && time < T(1)) {
        cuts.time[cuts.count] = time;
        cuts.volume[cuts.count++] = spanned_volume(start, x, time, at);
      }
    }
  }
  cuts.time[cuts.count] = T(1);
  cuts.volume[cuts.count++] = v[3];
  return cuts;
}

/// Where the four particles lie in one plane between the cuts `k` and `k + 1`, if they do: by
/// bisection and regula falsi in turns.
template <class T>
ATELIER_HOST_DEVICE inline bool becomes_flat(const Vec4<T>* start, const Vec4<T>* x,
                                             const VolumeCuts<T>& cuts, int k, Vec3<T>* at) {
  T low = cuts.time[k];
  T high = cuts.time[k + 1];
  T at_low = cuts.volume[k];
  T at_high = cuts.volume[k + 1];
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
  const T between = at_low - at_high;
  const T share = std::fabs(between) > T(0) ? at_low / between : T(0.5);
  spanned_volume(start, x, low + share * (high - low), at);
  return true;
}

/// True if four particles in one plane meet: a particle (the last) lies in the face before it or,
/// where `edges`, two edges cross.
template <class T>
ATELIER_HOST_DEVICE inline bool meet_in_plane(const Vec3<T>* at, bool edges) {
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

/// True if a pair meets between `start` and `x`. It may become coplanar up to three times: a
/// particle that passes a face and leaves its plane beside it again ends on the side on which it
/// began, and is crossed.
template <class T>
ATELIER_HOST_DEVICE inline bool passes(const Vec4<T>* start, const Vec4<T>* x, bool edges) {
  const VolumeCuts<T> cuts = volume_cuts(start, x);
  Vec3<T> at[4];
  for (int k = 0; k + 1 < cuts.count; ++k) {
    if (becomes_flat(start, x, cuts, k, at) && meet_in_plane(at, edges)) {
      return true;
    }
  }
  return false;
}

/// Lets a pair move as one along the direction `before` that it had at the substep's start, and
/// freely across it: `slide(particle, push)` for each of the free ones; where some are not, these
/// lead. A particle that stayed where it was would stick there, whatever pulled at it, for as long
/// as it would pass.
template <class T, class Slide>
ATELIER_HOST_DEVICE inline void slide_as_one(const int* particle, const Vec4<T>* start,
                                             const Vec4<T>* x, Vec3<T> before, const Slide& slide) {
  T along[4];
  T fixed = T(0);
  T together = T(0);
  int fixed_count = 0;
  const T size = norm(before);
  const Vec3<T> n = size > T(1e-7) ? (T(1) / size) * before : Vec3<T>{};
  for (int k = 0; k < 4; ++k) {
    along[k] = dot(n, xyz(x[k]) - xyz(start[k]));
    together += T(0.25) * along[k];
    if (!(x[k].w > T(0))) {
      fixed += along[k];
      ++fixed_count;
    }
  }
  if (fixed_count > 0) {
    together = fixed / static_cast<T>(fixed_count);
  }
  for (int k = 0; k < 4; ++k) {
    if (x[k].w > T(0)) {
      slide(particle[k], (together - along[k]) * n);
    }
  }
}

/// Motion of a pair in a substep.
enum class Passing {
  No,
  Free,  ///< passes: it is crossed, or has to come out of the body
  Kept   ///< would pass
};

/// Where four particles on their ways from `start` to `x` come to a little later; none goes further
/// than half the gap, so that pairs that no list holds need not be asked.
template <class T>
ATELIER_HOST_DEVICE inline void go_on(const Vec4<T>* start, const Vec4<T>* x, T gap,
                                      Vec4<T>* beyond) {
  T most = T(0);
  for (int k = 0; k < 4; ++k) {
    most = max_of(most, squared_norm(xyz(x[k]) - xyz(start[k])));
  }
  most = std::sqrt(most);
  const T wanted = static_cast<T>(kSelfMargin);
  const T margin = wanted * most > T(0.5) * gap ? T(0.5) * gap / most : wanted;
  for (int k = 0; k < 4; ++k) {
    beyond[k] = with_w(xyz(x[k]) + margin * (xyz(x[k]) - xyz(start[k])), x[k].w);
  }
}

/// Response to a pair that is kept back: `carry(particle)` is how what stays is moved on,
/// `slide(particle, push)` and `stay(particle, carry)` take what is wanted of a particle. Refers to
/// all three.
template <class Carry, class Slide, class Stay>
struct PairKeeping {
  const Carry& carry;
  const Slide& slide;
  const Stay& stay;
};
template <class Carry, class Slide, class Stay>
ATELIER_HOST_DEVICE inline PairKeeping<Carry, Slide, Stay> keeping_of(const Carry& carry,
                                                                      const Slide& slide,
                                                                      const Stay& stay) {
  return {carry, slide, stay};
}

/// Keeps a pair back that would pass. Where `slides`, see slide_as_one; else it is kept where the
/// substep began: each of the free ones stays, with the carry of each of the four. `motion`: a
/// ParticleMotion; `keeping`: a PairKeeping.
template <class T, class Motion, class Keeping>
ATELIER_HOST_DEVICE inline Passing keep_back(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                             bool edges, bool slides, const Motion& motion,
                                             const Keeping& keeping) {
  int particle[4];
  pair_particles(cloth, pair, edges, particle);
  Vec4<T> start[4];
  Vec4<T> x[4];
  Vec4<T> beyond[4];
  for (int k = 0; k < 4; ++k) {
    start[k] = motion.before(particle[k]);
    x[k] = motion.now(particle[k]);
  }
  go_on(start, x, pair.gap, beyond);
  if (stay_apart(start, beyond, edges ? 2 : 3, pair.gap) || !passes(start, beyond, edges)) {
    return Passing::No;
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
  // Free to come apart.
  if (both_tangled(cloth, pair, edges) ||
      in_wrong_order(cloth, pair, edges, before, motion.before)) {
    return Passing::Free;
  }
  // A particle that has to leave the body is not kept in it; it takes along what it would pass.
  Vec3<T> held[4];
  bool comes_out = false;
  bool follows = false;
  for (int k = 0; k < 4; ++k) {
    const Vec4<T> carried = keeping.carry(particle[k]);
    held[k] = x[k].w > T(0) ? xyz(carried) : xyz(x[k]) - xyz(start[k]);
    if (carried.w > T(0)) {
      x[k].w = T(0);
      comes_out = true;
    }
    follows = follows || x[k].w > T(0);
  }
  if (comes_out && !(slides && follows)) {
    return Passing::Free;
  }
  if (slides) {
    slide_as_one(particle, start, x, before, keeping.slide);
    return Passing::Kept;
  }
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4 && x[k].w > T(0); ++j) {
      keeping.stay(particle[k], held[j]);
    }
  }
  return Passing::Kept;
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
