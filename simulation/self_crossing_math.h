#pragma once

#include "simulation/self_push_math.h"

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

/// Lets a pair move as one along the direction `before` that it had at the substep's start, and
/// freely across it: `slide(particle, push)` for each of the free ones. What stayed where it was
/// would stick there, whatever pulled at it, for as long as it would pass.
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

/// What a pair does in a substep.
enum class Passing {
  No,
  Free,  ///< passes: it is crossed, or has to come out of the body
  Kept   ///< would pass
};

/// Keeps a pair back that would pass. Where `slides`, see slide_as_one; else it is kept where the
/// substep began: `stay(particle, carry)` for each of the free ones with the carry of each of the
/// four (`carry(particle)`).
template <class T, class Load, class LoadStart, class Carry, class Slide, class Stay>
ATELIER_HOST_DEVICE inline Passing keep_back(const SelfView<T>& cloth, const SelfPair<T>& pair,
                                             bool edges, bool slides, const Load& load,
                                             const LoadStart& load_start, const Carry& carry,
                                             const Slide& slide, const Stay& stay) {
  int particle[4];
  pair_particles(cloth, pair, edges, particle);
  Vec4<T> start[4];
  Vec4<T> x[4];
  for (int k = 0; k < 4; ++k) {
    start[k] = load_start(particle[k]);
    x[k] = load(particle[k]);
  }
  if (stay_apart(start, x, edges ? 2 : 3, pair.gap) || !passes(start, x, edges)) {
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
  if (!same_layer(cloth, particle[0], particle[3]) &&
      side_is_doubtful(cloth, pair, edges, before, load_start)) {
    return Passing::Free;
  }
  if (both_tangled(cloth, pair, edges)) {  // free to come apart
    return Passing::Free;
  }
  // Who has to come out of the body is not kept in it.
  Vec3<T> held[4];
  for (int k = 0; k < 4; ++k) {
    const Vec4<T> carried = carry(particle[k]);
    held[k] = x[k].w > T(0) ? xyz(carried) : xyz(x[k]) - xyz(start[k]);
    if (carried.w > T(0)) {
      return Passing::Free;
    }
  }
  if (slides) {
    slide_as_one(particle, start, x, before, slide);
    return Passing::Kept;
  }
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4 && x[k].w > T(0); ++j) {
      stay(particle[k], held[j]);
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
