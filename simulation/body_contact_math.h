#pragma once

#include <cmath>

#include "simulation/tree_math.h"
#include "simulation/vec4.h"

namespace atelier {

/// Corners of one triangle.
template <class T>
struct Corners {
  Vec3<T> a, b, c;
};

struct FaceIndices {
  int a, b, c;
};

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> weighted(const Corners<T>& t, Vec3<T> barycentric) {
  return barycentric.x * t.a + barycentric.y * t.b + barycentric.z * t.c;
}

/// Barycentric coordinates of the point of a triangle that is nearest to `p` (Ericson 2005,
/// "Real-time collision detection", 5.1.5).
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> nearest_on_triangle(Vec3<T> p, const Corners<T>& t) {
  const Vec3<T> ab = t.b - t.a;
  const Vec3<T> ac = t.c - t.a;
  const Vec3<T> ap = p - t.a;
  const T d1 = dot(ab, ap);
  const T d2 = dot(ac, ap);
  if (d1 <= T(0) && d2 <= T(0)) {
    return {T(1), T(0), T(0)};
  }
  const Vec3<T> bp = p - t.b;
  const T d3 = dot(ab, bp);
  const T d4 = dot(ac, bp);
  if (d3 >= T(0) && d4 <= d3) {
    return {T(0), T(1), T(0)};
  }
  const T vc = d1 * d4 - d3 * d2;
  if (vc <= T(0) && d1 >= T(0) && d3 <= T(0)) {
    const T v = d1 - d3 > T(0) ? d1 / (d1 - d3) : T(0);
    return {T(1) - v, v, T(0)};
  }
  const Vec3<T> cp = p - t.c;
  const T d5 = dot(ab, cp);
  const T d6 = dot(ac, cp);
  if (d6 >= T(0) && d5 <= d6) {
    return {T(0), T(0), T(1)};
  }
  const T vb = d5 * d2 - d1 * d6;
  if (vb <= T(0) && d2 >= T(0) && d6 <= T(0)) {
    const T w = d2 - d6 > T(0) ? d2 / (d2 - d6) : T(0);
    return {T(1) - w, T(0), w};
  }
  const T va = d3 * d6 - d5 * d4;
  if (va <= T(0) && d4 - d3 >= T(0) && d5 - d6 >= T(0)) {
    const T span = (d4 - d3) + (d5 - d6);
    const T w = span > T(0) ? (d4 - d3) / span : T(0);
    return {T(0), T(1) - w, w};
  }
  const T sum = va + vb + vc;
  if (!(sum > T(0))) {
    return {T(1), T(0), T(0)};
  }
  return {va / sum, vb / sum, vc / sum};
}

/// The body during one frame: its vertices move linearly from `start` to `end`. The boxes of the
/// tree cover the whole motion.
template <class T>
struct BodyView {
  const FaceIndices* faces;
  const Vec4<T>* start;
  const Vec4<T>* end;
  const TreeNode<T>* nodes;
  int face_count;  ///< 0: no body
};

template <class T>
ATELIER_HOST_DEVICE inline Corners<T> corners_at(const BodyView<T>& body, int face, T time) {
  const FaceIndices f = body.faces[face];
  const auto at = [&](int v) {
    const Vec3<T> s = xyz(body.start[v]);
    return s + time * (xyz(body.end[v]) - s);
  };
  return {at(f.a), at(f.b), at(f.c)};
}

template <class T>
ATELIER_HOST_DEVICE inline Box<T> swept_box(const BodyView<T>& body, int face) {
  const FaceIndices f = body.faces[face];
  Box<T> box = empty_box<T>();
  for (int v : {f.a, f.b, f.c}) {
    grow(box, xyz(body.start[v]));
    grow(box, xyz(body.end[v]));
  }
  return box;
}

/// The nearest body triangle found so far. Where two are as near (a shared edge or corner), the one
/// whose plane is further away knows the side.
template <class T>
struct NearestFace {
  T squared_distance;
  T side;  ///< signed distance to its plane
  int face;
  Vec3<T> barycentric;
};

template <class T>
ATELIER_HOST_DEVICE inline void offer_face(NearestFace<T>& best, Vec3<T> p, int face,
                                           const Corners<T>& t) {
  const Vec3<T> barycentric = nearest_on_triangle(p, t);
  const Vec3<T> d = p - weighted(t, barycentric);
  const T squared = squared_norm(d);
  if (squared > best.squared_distance * T(1.00001)) {
    return;
  }
  const Vec3<T> n = cross(t.b - t.a, t.c - t.a);
  const T nn = squared_norm(n);
  if (!(nn > T(0))) {
    return;
  }
  const T side = dot(n, p - t.a) / std::sqrt(nn);
  if (squared < best.squared_distance * T(0.99999) || std::fabs(side) > std::fabs(best.side) ||
      best.face < 0) {
    best = {smaller(squared, best.squared_distance), side, face, barycentric};
  }
}

/// A particle touching the body.
template <class T>
struct BodyTouch {
  Vec3<T> normal;  ///< outwards, unit
  Vec3<T> point;   ///< on the body at the end of the substep
  Vec3<T> moved;   ///< how the body's point moved in the substep
  T distance;      ///< of the particle at the end, along the normal
  T start_distance;
  bool valid;
};

template <class T>
ATELIER_HOST_DEVICE inline BodyTouch<T> touch_at(const BodyView<T>& body, int face,
                                                 Vec3<T> barycentric, Vec3<T> normal, Vec3<T> x,
                                                 Vec3<T> start, T t0, T t1) {
  BodyTouch<T> out;
  const Vec3<T> p0 = weighted(corners_at(body, face, t0), barycentric);
  const Vec3<T> p1 = weighted(corners_at(body, face, t1), barycentric);
  out.normal = normal;
  out.point = p1;
  out.moved = p1 - p0;
  out.distance = dot(normal, x - p1);
  out.start_distance = dot(normal, start - p0);
  out.valid = true;
  return out;
}

/// Contact of one particle with the nearest face found, if it is nearer than `thickness`.
template <class T>
ATELIER_HOST_DEVICE inline BodyTouch<T> touch_nearest(const BodyView<T>& body,
                                                      const NearestFace<T>& best, Vec3<T> x,
                                                      Vec3<T> start, T t0, T t1, T thickness) {
  BodyTouch<T> out;
  out.valid = false;
  if (best.face < 0) {
    return out;
  }
  const T distance = std::sqrt(best.squared_distance);
  if (best.side >= T(0) && distance >= thickness) {
    return out;
  }
  const Corners<T> t = corners_at(body, best.face, t1);
  Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
  normal = (T(1) / norm(normal)) * normal;
  const Vec3<T> b = best.barycentric;
  const bool inside_face = b.x > T(0) && b.y > T(0) && b.z > T(0);
  if (!inside_face && distance > T(1e-5)) {
    const Vec3<T> d = x - weighted(t, b);
    normal = (best.side >= T(0) ? T(1) / distance : T(-1) / distance) * d;
  }
  return touch_at(body, best.face, b, normal, x, start, t0, t1);
}

/// Time in [0, 1] at which a particle moving from `p0` to `p1` passes from the outside through a
/// moving triangle, or a value above 1. The cubic is solved by regula falsi between its signs.
template <class T>
ATELIER_HOST_DEVICE inline T crossing_time(Vec3<T> p0, Vec3<T> p1, const Corners<T>& t0,
                                           const Corners<T>& t1, Vec3<T>& barycentric) {
  const T never = T(2);
  const auto height = [](Vec3<T> p, const Corners<T>& t) {
    return dot(cross(t.b - t.a, t.c - t.a), p - t.a);
  };
  T low = T(0);
  T high = T(1);
  T at_low = height(p0, t0);
  T at_high = height(p1, t1);
  if (at_low < T(0) || at_high >= T(0)) {
    return never;
  }
  T time = T(0);
  Corners<T> t = t0;
  Vec3<T> p = p0;
  for (int i = 0; i < 4; ++i) {
    time = low + (high - low) * (at_low / (at_low - at_high));
    t = {t0.a + time * (t1.a - t0.a), t0.b + time * (t1.b - t0.b), t0.c + time * (t1.c - t0.c)};
    p = p0 + time * (p1 - p0);
    const T value = height(p, t);
    if (value >= T(0)) {
      low = time;
      at_low = value;
    } else {
      high = time;
      at_high = value;
    }
    if (!(at_low - at_high > T(0))) {
      break;
    }
  }
  const Vec3<T> n = cross(t.b - t.a, t.c - t.a);
  const T nn = squared_norm(n);
  if (!(nn > T(0))) {
    return never;
  }
  const T v = dot(n, cross(p - t.a, t.c - t.a)) / nn;
  const T w = dot(n, cross(t.b - t.a, p - t.a)) / nn;
  const T slack = T(1e-4);
  if (v < -slack || w < -slack || v + w > T(1) + slack) {
    return never;
  }
  barycentric = {T(1) - v - w, v, w};
  return time;
}

/// What a contact with the body obeys.
template <class T>
struct BodyContactRule {
  T thickness;    ///< m
  T friction;     ///< Coulomb coefficient
  T reach;        ///< m, how deep an overlap may be and still be found
  T old_overlap;  ///< m at most taken off an overlap that was there before, per substep
};

/// Moves a particle out of the body and lets friction hold it (Coulomb: exact stick inside the
/// cone). `held` carries, over the iterations of one substep, the tangential correction so far
/// (xyz) and the normal one (w). An overlap that was there at the start moves `start` along, so
/// that it does not become speed.
template <class T>
ATELIER_HOST_DEVICE inline void resolve_touch(Vec4<T>& x, Vec4<T>& start, Vec4<T>& held,
                                              const BodyTouch<T>& touch,
                                              const BodyContactRule<T>& rule, bool with_friction) {
  const T wanted = rule.thickness - touch.distance;
  if (!(wanted > T(0))) {
    return;
  }
  const T fresh = larger(T(0), touch.start_distance - touch.distance);
  const T correction = smaller(wanted, fresh + rule.old_overlap);
  const T old = larger(T(0), correction - fresh);
  const Vec3<T> n = touch.normal;
  x = with_w(xyz(x) + correction * n, x.w);
  start = with_w(xyz(start) + old * n, start.w);
  if (!with_friction) {
    return;
  }
  held.w += correction - old;
  const Vec3<T> relative = (xyz(x) - xyz(start)) - touch.moved;
  const Vec3<T> slip = relative - dot(relative, n) * n;
  Vec3<T> hold = xyz(held) - slip;
  const T size = norm(hold);
  const T most = rule.friction * held.w;
  if (size > most) {
    hold = (most / size) * hold;
  }
  x = with_w(xyz(x) + (hold - xyz(held)), x.w);
  held = with_w(hold, held.w);
}

/// Contact of one free particle with the body in one substep [t0, t1] of the frame. `visit(f)`
/// calls f(face) for every face that may matter. First what it would pass through, else the nearest
/// face; then once more the nearest (a corner between two surfaces). Returns true if it touched.
template <class T, class Faces>
ATELIER_HOST_DEVICE inline bool contact_particle(Vec4<T>& x, Vec4<T>& start, Vec4<T>& held,
                                                 const BodyView<T>& body, T t0, T t1,
                                                 const BodyContactRule<T>& rule,
                                                 const Faces& visit) {
  NearestFace<T> nearest{rule.reach * rule.reach, T(0), -1, {}};
  T first = T(2);
  int hit_face = -1;
  Vec3<T> hit_barycentric{};
  const Vec3<T> p1 = xyz(x);
  const Vec3<T> p0 = xyz(start);
  visit([&](int face) {
    const Corners<T> c1 = corners_at(body, face, t1);
    offer_face(nearest, p1, face, c1);
    // Only what ends behind the plane can have passed it.
    if (dot(cross(c1.b - c1.a, c1.c - c1.a), p1 - c1.a) < T(0)) {
      Vec3<T> barycentric{};
      const T time = crossing_time(p0, p1, corners_at(body, face, t0), c1, barycentric);
      if (time < first) {
        first = time;
        hit_face = face;
        hit_barycentric = barycentric;
      }
    }
  });
  BodyTouch<T> touch;
  if (hit_face >= 0) {
    const Corners<T> t = corners_at(body, hit_face, t1);
    Vec3<T> normal = cross(t.b - t.a, t.c - t.a);
    normal = (T(1) / norm(normal)) * normal;
    touch = touch_at(body, hit_face, hit_barycentric, normal, p1, p0, t0, t1);
  } else {
    touch = touch_nearest(body, nearest, p1, p0, t0, t1, rule.thickness);
  }
  if (!touch.valid) {
    return false;
  }
  resolve_touch(x, start, held, touch, rule, true);
  nearest = {rule.reach * rule.reach, T(0), -1, {}};
  const Vec3<T> moved = xyz(x);
  visit([&](int face) { offer_face(nearest, moved, face, corners_at(body, face, t1)); });
  touch = touch_nearest(body, nearest, moved, xyz(start), t0, t1, rule.thickness);
  if (touch.valid) {
    resolve_touch(x, start, held, touch, rule, false);
  }
  return true;
}

/// Faces that a particle may meet during a frame.
constexpr int kBodyCandidates = 16;
constexpr int kSearchTree =
    -1;  ///< instead of a count: too many, or inside: ask the tree each time

/// Collects them for a particle that is expected to move by at most `motion` during the frame:
/// every face whose distance now is below both motions and the thickness. Returns how many, or
/// kSearchTree.
template <class T>
ATELIER_HOST_DEVICE inline int collect_candidates(const BodyView<T>& body, Vec3<T> x, T motion,
                                                  const BodyContactRule<T>& rule, int* candidates) {
  NearestFace<T> nearest{rule.reach * rule.reach, T(0), -1, {}};
  int count = 0;
  const T radius = larger(rule.reach, motion + rule.thickness);
  visit_tree(body.nodes, inflated(Box<T>{x, x}, radius), [&](int face) {
    const Corners<T> t = corners_at(body, face, T(0));
    offer_face(nearest, x, face, t);
    const FaceIndices f = body.faces[face];
    T body_motion = T(0);
    for (int v : {f.a, f.b, f.c}) {
      body_motion = larger(body_motion, squared_norm(xyz(body.end[v]) - xyz(body.start[v])));
    }
    const T bound = motion + std::sqrt(body_motion) + rule.thickness;
    const T distance = squared_norm(x - weighted(t, nearest_on_triangle(x, t)));
    if (distance <= bound * bound) {
      if (count < kBodyCandidates) {
        candidates[count] = face;
      }
      ++count;
    }
  });
  const bool inside = nearest.face >= 0 && nearest.side < T(0);
  return inside || count > kBodyCandidates ? kSearchTree : count;
}

/// Contact of one particle by its candidates, or by the tree where it moved further than expected.
template <class T>
ATELIER_HOST_DEVICE inline bool contact_by_candidates(Vec4<T>& x, Vec4<T>& start, Vec4<T>& held,
                                                      const BodyView<T>& body, T t0, T t1,
                                                      const BodyContactRule<T>& rule,
                                                      Vec3<T> frame_start, T motion, int count,
                                                      const int* candidates) {
  if (count != kSearchTree && squared_norm(xyz(x) - frame_start) <= motion * motion) {
    if (count == 0) {
      return false;
    }
    return contact_particle(x, start, held, body, t0, t1, rule, [&](const auto& visit) {
      for (int i = 0; i < count; ++i) {
        visit(candidates[i]);
      }
    });
  }
  Box<T> box{xyz(x), xyz(x)};
  grow(box, xyz(start));
  const Box<T> query = inflated(box, rule.reach);
  return contact_particle(x, start, held, body, t0, t1, rule,
                          [&](const auto& visit) { visit_tree(body.nodes, query, visit); });
}

/// How far a particle is expected to move in a frame: what it would fly, and a margin for what
/// pulls at it [m]. Further than that, and the tree is asked in every substep.
template <class T>
ATELIER_HOST_DEVICE inline T expected_motion(Vec3<T> velocity, Vec3<T> acceleration, T frame) {
  const T margin = T(0.003);
  return norm(velocity) * frame + T(0.5) * norm(acceleration) * frame * frame + margin;
}

/// Depth of a particle inside the body at time 1, 0 outside [m].
template <class T>
ATELIER_HOST_DEVICE inline T depth_inside(const BodyView<T>& body, Vec3<T> x, T reach) {
  NearestFace<T> nearest{reach * reach, T(0), -1, {}};
  visit_tree(body.nodes, inflated(Box<T>{x, x}, reach),
             [&](int face) { offer_face(nearest, x, face, corners_at(body, face, T(1))); });
  return nearest.face >= 0 && nearest.side < T(0) ? std::sqrt(nearest.squared_distance) : T(0);
}

}  // namespace atelier
