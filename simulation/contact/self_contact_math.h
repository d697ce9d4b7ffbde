#pragma once

#include <cstdint>

#include "simulation/contact/body_contact_math.h"

namespace atelier {

/// Contact of cloth with itself and between layers: vertex against triangle and edge against edge.
///
/// Pairs (self_search_math.h). A search lists every pair that may come nearer than its gap while
/// each particle stays within `slack` of a straight swept motion (the displacement bound of Chen et
/// al. 2025, "Offset geometric contact", measured from the swept motion and not from a point, so
/// that cloth that is carried along keeps its pairs). A particle that leaves it gets a new one and
/// more slack until the frame ends, and the pairs of those particles alone are looked for again;
/// all are where the list has grown too old and where many left. So nothing is missed, and how
/// often is searched changes no bit of what comes out.
///
/// Pushes (collision_response_math.h). In a substep a pair keeps the side on which it was at the
/// substep's start. Pairs are solved at once (Jacobi); a particle takes in each direction the
/// largest push and the largest against it. These are integers of 2^-30 m and extremes, so their
/// order does not matter and every run gives the same bits. A corner or an edge pushes only where
/// it is what lies nearest (the normal cones of the same paper): else the edges of two flat sheets
/// would lock like the teeth of a rack.
///
/// Passes (self_crossing_math.h). After pushes and the body, a pair that would pass goes back to
/// where the substep began, carried along by the body or the pin that holds one of its particles
/// (rigid impact zones, Provot 1997), and the body asks for less and less of its distance there: so
/// nothing that was not crossed gets crossed, also where a body presses. Pairs that are crossed all
/// the same (initially, or on leaving the body) are pulled apart along the gradient of the length
/// of the intersection (Volino and Magnenat-Thalmann 2006), layers to the side on which they
/// belong. Crossings are searched for at the frame's first substep; at a later one, around what
/// contacts moved in the substep before, where that let something pass or kept something back, and
/// around what was crossed.

/// An edge with its faces.
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
  const int* across;         ///< [3 F] corner beyond the edge from corner k to k + 1, or -1
  const int* ring_begin;     ///< [V + 1] into `ring`
  const int* ring;           ///< neighbours of each particle
  const Vec4<T>* rest;       ///< template positions: sheets that lie close there may stay close
  const int* layer;          ///< of particles, or null
  const int* tangled;        ///< of particles: 1 where a piece around it is crossed
  const T* slack = nullptr;  ///< m, of particles, at least the rule's; null: the rule's
  T past = T(0);             ///< share of the swept motions that lies behind
};

template <class T>
struct SelfRule {
  T thickness;  ///< m
  T friction;
  T old_overlap;  ///< m per substep at most off an overlap that was there before
  T slack;        ///< m, by which a particle may leave its swept motion before a new search
  T untangle;     ///< m per substep by which crossed pieces are pulled
  int horizon;    ///< substeps for which a search looks ahead
};

constexpr int kSelfResponses = 10;  ///< passes of pushes in a substep, at most
constexpr int kSelfSlides = 6;      ///< of keeping back the first, in which a pair slides on itself
constexpr int kSelfRides =
    8;  ///< and the next, in which a kept particle moves with the body near it
constexpr int kSelfStays = 8;  ///< and the next, in which the body leaves it half of its distance
/// Share of its way that a pair may not pass beyond it either: a pair that ended exactly in contact
/// would have no side in the next substep.
constexpr double kSelfMargin = 0.25;
constexpr double kSelfRest = 0.02;  ///< of the gap: a push below it needs no further pass
/// Where more than one in so many left their swept motions, all pairs are looked for again.
constexpr int kSelfFew = 8;
constexpr double kSelfNearly =
    0.75;  ///< of its slack: a particle that far from its swept motion may leave it

/// How a particle that was kept back in pass `keep` meets the body.
ATELIER_HOST_DEVICE inline Meeting meeting_in_pass(int keep) {
  return keep < kSelfSlides                             ? Meeting::Touches
         : keep < kSelfSlides + kSelfRides              ? Meeting::Rides
         : keep < kSelfSlides + kSelfRides + kSelfStays ? Meeting::Stays
                                                        : Meeting::Leaves;
}

/// Passes of keeping back what would pass, at most, and in which of them carries begin anew with
/// what the body asks in them.
struct SelfKeeps {
  static constexpr int kPasses = 30;
  ATELIER_HOST_DEVICE static bool asks_body_anew(int /*pass*/) { return false; }
};

constexpr int kSupportLevels = 64;  ///< of particles that rest on one another, see ResponseSum

/// A pair that may meet: particle (or edge) and face (or edge), and the gap that it keeps.
template <class T>
struct alignas(16) SelfPair {
  int first, second;
  T gap;
  int search = 0;  ///< that found it
};

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> swept_motion(const SelfView<T>& cloth, int i) {
  return xyz(cloth.surface.end[i]) - xyz(cloth.surface.start[i]);
}

/// A particle on its swept motion now, and how it goes on.
template <class T>
struct FlyingPoint {
  Vec3<T> at, on;
};
template <class T>
ATELIER_HOST_DEVICE inline FlyingPoint<T> flying(const SelfView<T>& cloth, int i) {
  const Vec3<T> whole = swept_motion(cloth, i);
  return {xyz(cloth.surface.start[i]) + cloth.past * whole, (T(1) - cloth.past) * whole};
}

/// By how much a particle may leave its swept motion [m].
template <class T>
ATELIER_HOST_DEVICE inline T slack_of(const SelfView<T>& cloth, int i, const SelfRule<T>& rule) {
  return cloth.slack == nullptr ? rule.slack : cloth.slack[i];
}

template <class T>
ATELIER_HOST_DEVICE inline bool same_layer(const SelfView<T>& cloth, int first, int second) {
  return cloth.layer == nullptr || cloth.layer[first] == cloth.layer[second];
}

/// True if particle `i` or a neighbour began the frame inside the body: it has to come out, and
/// cloth does not keep it back. `outlook`: of the particles.
template <class T>
ATELIER_HOST_DEVICE inline bool comes_out(const SelfView<T>& cloth, const BodyOutlook<T>* outlook,
                                          int i) {
  bool inside = began_inside(outlook[i]);
  for (int k = cloth.ring_begin[i]; k < cloth.ring_begin[i + 1]; ++k) {
    inside = inside || began_inside(outlook[cloth.ring[k]]);
  }
  return inside;
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

/// True if the first `split` of four particles and the others stay more than `gap` apart along an
/// axis all the way from `start` to `x`: then they cannot pass.
template <class T>
ATELIER_HOST_DEVICE inline bool stay_apart(const Vec4<T>* start, const Vec4<T>* x, int split,
                                           T gap) {
  Box<T> box[2] = {empty_box<T>(), empty_box<T>()};
  for (int k = 0; k < 4; ++k) {
    Box<T>& own = box[k < split ? 0 : 1];
    grow(own, xyz(start[k]));
    grow(own, xyz(x[k]));
  }
  return !overlap(inflated(box[0], gap), box[1]);
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

}  // namespace atelier
