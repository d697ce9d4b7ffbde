#pragma once

#include "simulation/contact/self_crossing_math.h"
#include "simulation/contact/self_search_math.h"

namespace atelier {

/// Contact of the body's corners with the cloth's triangles and of its edges with the cloth's
/// edges: what comes through between the cloth's vertices, which body_contact_math.h keeps outside.
///
/// Which. Cloth whose vertices keep the contact's thickness dips below a body that turns by an
/// angle over its edge's length l by about l / 8 of it. Where the thickness makes up for twice
/// that, vertices are enough; the body's other convex edges, and the corners at them, are its sharp
/// features: fingers, toes, a knee of a coarse mesh. Concave edges and the rim of an open surface
/// have nothing that could come through. Our choice; so a smooth body costs nothing.
///
/// Where. A second tree over the body's faces, refitted with it, whose boxes are empty but for
/// faces with sharp features. A frame lists the triangles of the cloth whose flights come near to
/// one; a substep asks the tree for those and for whose particles left their flights, so nothing is
/// missed.
///
/// Pushes. Those of collision_response_math.h, the body's points with an inverse mass of 0: a pair
/// keeps the side that it had at the substep's start, by half of the thickness, with friction;
/// pushes are extremes of integers, whose order does not matter. A feature pushes only where it is
/// what lies nearest of its body, or where the pair would pass in the substep. A particle that has
/// come through a little all the same goes out along the feature's normal, if the face of the body
/// that lies nearest looks that way too: not to the palm what lies on the back of a hand.
///
/// A body that overlaps itself: a feature within another limb pushes nothing, nor is cloth pushed
/// that lies in one; and the cloth's vertices meet the body's faces after its features, so that in
/// the end none is inside and what is pinched lies between (touch_again).

/// The body's edges and corners.
template <class T>
struct BodyFeatures {
  const ClothEdge* edges;
  const int* edge_of;     ///< [3 F] edge from corner k to k + 1
  const int* corner_of;   ///< [3 F] corner k where this face stands for it, else -1
  const int* ring_begin;  ///< [vertices + 1] into `ring`
  const int* ring;        ///< faces round each vertex
  const int* sharp;  ///< [F] of the frame: bit k corner k, bit 3 + k edge k, which it stands for
  const T* least;    ///< [F] of the frame: cloth with shorter edges needs none of these [m]
  const BoxNode<T>* nodes;  ///< tree over faces that have any
};

/// Parameters of contacts between features.
template <class T>
struct FeatureRule {
  SelfRule<T> push;
  T gap;     ///< m that a pair keeps
  T within;  ///< m, how far one may have come through and be taken back; at least `gap`
};

constexpr int kFeaturePasses = 4;  ///< of pushes in a substep, at most

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> face_normal_at(const BodyView<T>& body, int face, T time) {
  const FaceCorners<T> t = corners_at(body, face, time);
  return cross(t.b - t.a, t.c - t.a);
}

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> unit_or_zero(Vec3<T> v) {
  const T size = norm(v);
  return size > T(0) ? (T(1) / size) * v : Vec3<T>{};
}

template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> body_point(const BodyView<T>& body, int v, T time) {
  return between(xyz(body.start[v]), xyz(body.end[v]), time);
}

/// How long an edge of cloth has to be [m] to dip over an edge of the body, as the frame begins, by
/// more than half of `thickness`; 1e15 where none does.
template <class T>
ATELIER_HOST_DEVICE inline T min_length_over(const BodyView<T>& body, const ClothEdge& edge,
                                             T thickness) {
  const T never = T(1e15);
  if (edge.face[1] < 0) {
    return never;
  }
  const auto at = [&](int v) { return xyz(body.start[v]); };
  const auto normal = [&](const FaceIndices& f) {
    return cross(at(f.b) - at(f.a), at(f.c) - at(f.a));
  };
  const Vec3<T> n0 = normal(body.faces[edge.face[0]]);
  const Vec3<T> n1 = normal(body.faces[edge.face[1]]);
  const T twice0 = norm(n0);
  const T twice1 = norm(n1);
  const Vec3<T> a = at(edge.a);
  const Vec3<T> beyond = at(edge.opposite[1]) - a;
  if (!(twice0 > T(0)) || !(twice1 > T(0)) || !(dot(n0, beyond) < T(0))) {
    return never;
  }
  const T turn = norm((T(1) / twice0) * n0 - (T(1) / twice1) * n1);
  // The faces' centres lie a third of their heights apart: over each such way it turns as much.
  const T apart = (twice0 + twice1) / (T(3) * norm(at(edge.b) - a));
  const T over_one = T(4) * thickness / max_of(turn, T(1e-6));
  return over_one <= apart ? over_one : std::sqrt(over_one * apart);
}

/// The features that a face represents: see BodyFeatures::sharp and ::least.
template <class T>
struct SharpOfFace {
  int bits;
  T least;
};

/// The sharp features that a face stands for to cloth with edges of up to `longest`; `least` of
/// each edge.
template <class T>
ATELIER_HOST_DEVICE inline SharpOfFace<T> sharp_of_face(const BodyFeatures<T>& features, int face,
                                                        const T* least, T longest) {
  SharpOfFace<T> out{0, T(1e15)};
  for (int k = 0; k < 3; ++k) {
    const int e = features.edge_of[3 * face + k];
    if (least[e] <= longest && features.edges[e].face[0] == face) {
      out.bits |= 8 << k;
      out.least = min_of(out.least, least[e]);
    }
    const int v = features.corner_of[3 * face + k];
    if (v < 0) {
      continue;
    }
    for (int r = features.ring_begin[v]; r < features.ring_begin[v + 1]; ++r) {
      const int* const around = features.edge_of + 3 * features.ring[r];
      for (int side = 0; side < 3; ++side) {
        const ClothEdge& edge = features.edges[around[side]];
        if (least[around[side]] <= longest && (edge.a == v || edge.b == v)) {
          out.bits |= 1 << k;
          out.least = min_of(out.least, least[around[side]]);
        }
      }
    }
  }
  return out;
}

/// Outward direction of a corner or an edge of the body, by the areas of its faces.
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> corner_normal(const BodyView<T>& body,
                                                 const BodyFeatures<T>& features, int v, T time) {
  Vec3<T> sum{};
  for (int r = features.ring_begin[v]; r < features.ring_begin[v + 1]; ++r) {
    sum += face_normal_at(body, features.ring[r], time);
  }
  return unit_or_zero(sum);
}
template <class T>
ATELIER_HOST_DEVICE inline Vec3<T> edge_normal(const BodyView<T>& body, const ClothEdge& edge,
                                               T time) {
  return unit_or_zero(unit_or_zero(face_normal_at(body, edge.face[0], time)) +
                      unit_or_zero(face_normal_at(body, edge.face[1], time)));
}

/// True if a particle left its free flight of the frame by more than its outlook's `slack`.
template <class T>
ATELIER_HOST_DEVICE inline bool left_outlook(Vec3<T> x, Vec3<T> frame_start, Vec3<T> flight,
                                             T slack, T t1) {
  return squared_norm(x - frame_start - t1 * flight) > slack * slack;
}

/// The substep [t0, t1] of a frame, as its features see it.
template <class T>
struct FeatureStep {
  BodyView<T> body;
  BodyFeatures<T> features;
  SelfView<T> cloth;  ///< its surface, edges and rings
  FeatureRule<T> rule;
  T t0, t1;
};

/// Points of a feature and of the cloth that may touch, and where the feature looks.
template <class T>
struct FeatureTouch {
  Vec3<T> on_cloth, on_body, outwards;
  bool outside;  ///< of the feature
};

/// Whether a feature pushes a point of the cloth: one outside of the whole body where `outside`,
/// else one just inside, of which the nearest face looks the feature's way too. Features inside
/// another limb, or where the body overlaps itself, are left to the cloth's vertices. `team` asks
/// the body (see AloneInTree).
template <class T, class Team>
ATELIER_HOST_DEVICE inline bool feature_reaches(const FeatureStep<T>& step,
                                                const FeatureTouch<T>& touch, const Team& team) {
  const BodyView<T>& body = step.body;
  const Vec3<T> x = touch.on_cloth;
  if (times_inside(body, x, step.t0, team) != (touch.outside ? 0 : 1)) {
    return false;
  }
  if (!touch.outside) {
    const T within = step.rule.within;
    const FaceOffer<T> nearest = choose_in_tree(body, inflated(Box<T>{x, x}, within),
                                                standing(x, step.t0), within, false, team)
                                     .nearest;
    if (!(nearest.face >= 0 && nearest.side < T(0) &&
          dot(face_normal_at(body, nearest.face, step.t0), touch.outwards) > T(0))) {
      return false;
    }
  }
  // Within another limb it is no surface.
  return times_inside(body, touch.outwards * T(1e-4) + touch.on_body, step.t0, team) <= 0;
}

/// Instead of a team: every feature reaches, which is to be found out later.
struct ReachesUnasked {};
template <class T>
ATELIER_HOST_DEVICE inline bool feature_reaches(const FeatureStep<T>&, const FeatureTouch<T>&,
                                                ReachesUnasked) {
  return true;
}

/// Pushes the cloth of a pair (its particles come first) off a feature that looks along `outwards`
/// at the substep's start. `nearest`: the feature is what lies nearest of its body. `passes()`: the
/// pair would pass. `add(particle, fresh, calm, level)`, of the cloth's alone. `team`: see
/// feature_reaches.
template <class T, class Passes, class Add, class Team>
ATELIER_HOST_DEVICE inline PairState push_off_feature(const FeatureStep<T>& step,
                                                      const PairPoints<T>& pair, Vec3<T> outwards,
                                                      bool nearest, const Passes& passes,
                                                      const Add& add, const Team& team) {
  Vec3<T> before{};
  Vec3<T> now{};
  Vec3<T> on_cloth{};
  Vec3<T> on_body{};
  for (int k = 0; k < 4; ++k) {
    before += pair.weight[k] * xyz(pair.start[k]);
    now += pair.weight[k] * xyz(pair.x[k]);
    (k < pair.split ? on_cloth : on_body) += pair.weight[k] * xyz(pair.start[k]);
  }
  const bool outside = dot(before, outwards) > T(0);
  if (outside) {
    const bool far = dot(now, before) >= step.rule.gap * norm(before) && dot(now, before) > T(0);
    if (!(nearest && !far) && !passes()) {
      return PairState::Apart;
    }
  } else if (squared_norm(before) > step.rule.within * step.rule.within) {
    return PairState::Apart;
  }
  // First what it wants, which is mostly nothing; what asks the trees comes after.
  Vec3<T> wanted[2][3] = {};
  int cloth = 0;
  const PairState state = push_apart(
      pair, PairDirection<T>{outwards, outside ? Vec3<T>{} : outwards}, step.rule.gap,
      step.rule.push, [](int) { return 0; },
      [&](int i, Vec3<T> fresh, Vec3<T> calm, int) {
        if (i >= 0) {
          wanted[0][cloth] = fresh;
          wanted[1][cloth++] = calm;
        }
      });
  // `on_body` is minus the body's point.
  if (state == PairState::Apart ||
      !feature_reaches(step, FeatureTouch<T>{on_cloth, -on_body, outwards, outside}, team)) {
    return PairState::Apart;
  }
  for (int k = 0; k < cloth; ++k) {
    add(pair.particle[k], wanted[0][k], wanted[1][k], 0);
  }
  return state;
}

/// Puts a body's vertex into place `k` of a pair.
template <class T>
ATELIER_HOST_DEVICE inline void put_body_point(const FeatureStep<T>& step, int v, int k,
                                               PairPoints<T>& pair) {
  pair.particle[k] = -1;
  pair.start[k] = with_w(body_point(step.body, v, step.t0), T(0));
  pair.x[k] = with_w(body_point(step.body, v, step.t1), T(0));
}

/// A corner of the body and a triangle of the cloth.
template <class T, class Motion, class Add, class Team>
ATELIER_HOST_DEVICE inline PairState push_off_corner(const FeatureStep<T>& step, int face, int v,
                                                     const Motion& motion, const Add& add,
                                                     const Team& team) {
  const FaceIndices f = step.cloth.surface.faces[face];
  PairPoints<T> pair{{f.a, f.b, f.c, -1}, {}, 3, {}, {}};
  for (int k = 0; k < 3; ++k) {
    pair.start[k] = motion.before(pair.particle[k]);
    pair.x[k] = motion.now(pair.particle[k]);
  }
  put_body_point(step, v, 3, pair);
  if (stay_apart(pair.start, pair.x, 3, step.rule.within)) {
    return PairState::Apart;
  }
  const FaceCorners<T> t{xyz(pair.start[0]), xyz(pair.start[1]), xyz(pair.start[2])};
  const Vec3<T> corner = xyz(pair.start[3]);
  const Vec3<T> b = nearest_on_triangle(corner, t);
  const Vec3<T> at = weighted(t, b);
  pair.weight[0] = b.x;
  pair.weight[1] = b.y;
  pair.weight[2] = b.z;
  pair.weight[3] = T(-1);
  bool nearest = is_nearest_piece(step.cloth, face, b, at, corner - at, motion.before);
  const BodyFeatures<T>& features = step.features;
  for (int r = features.ring_begin[v]; nearest && r < features.ring_begin[v + 1]; ++r) {
    const FaceCorners<T> around = corners_at(step.body, features.ring[r], step.t0);
    nearest = !leans_towards(at - corner, corner, around.a) &&
              !leans_towards(at - corner, corner, around.b) &&
              !leans_towards(at - corner, corner, around.c);
  }
  return push_off_feature(
      step, pair, corner_normal(step.body, features, v, step.t0), nearest,
      [&] { return passes(pair.start, pair.x, false); }, add, team);
}

/// An edge of the body and an edge of the cloth.
template <class T, class Motion, class Add, class Team>
ATELIER_HOST_DEVICE inline PairState push_off_edge(const FeatureStep<T>& step, int e, int body_edge,
                                                   const Motion& motion, const Add& add,
                                                   const Team& team) {
  const ClothEdge own = step.cloth.edges[e];
  const ClothEdge other = step.features.edges[body_edge];
  PairPoints<T> pair{{own.a, own.b, -1, -1}, {}, 2, {}, {}};
  for (int k = 0; k < 2; ++k) {
    pair.start[k] = motion.before(pair.particle[k]);
    pair.x[k] = motion.now(pair.particle[k]);
  }
  put_body_point(step, other.a, 2, pair);
  put_body_point(step, other.b, 3, pair);
  if (stay_apart(pair.start, pair.x, 2, step.rule.within)) {
    return PairState::Apart;
  }
  const SegmentShares<T> near = nearest_on_segments(xyz(pair.start[0]), xyz(pair.start[1]),
                                                    xyz(pair.start[2]), xyz(pair.start[3]));
  pair.weight[0] = T(1) - near.s;
  pair.weight[1] = near.s;
  pair.weight[2] = near.t - T(1);
  pair.weight[3] = -near.t;
  // At an end it is a corner that meets something.
  bool nearest = near.s > T(0) && near.s < T(1) && near.t > T(0) && near.t < T(1);
  const Vec3<T> on_cloth = between(xyz(pair.start[0]), xyz(pair.start[1]), near.s);
  const Vec3<T> on_body = between(xyz(pair.start[2]), xyz(pair.start[3]), near.t);
  const Vec3<T> before = on_cloth - on_body;
  for (int k = 0; nearest && k < 2; ++k) {
    nearest = !leans_towards(before, on_body, body_point(step.body, other.opposite[k], step.t0)) &&
              !(own.face[k] >= 0 &&
                leans_towards(-before, on_cloth, xyz(motion.before(own.opposite[k]))));
  }
  return push_off_feature(
      step, pair, edge_normal(step.body, other, step.t0), nearest,
      [&] { return passes(pair.start, pair.x, true); }, add, team);
}

/// Triangles of the cloth as features of the body meet them.
template <class T>
struct PushedFaces {
  const int* edge_of;  ///< [3 F] edges that each stands for, else -1
  const T* length;     ///< [F] m, of the longest edge of each
};

/// Pushes a triangle of the cloth, and the edges that it stands for, off the sharp features of one
/// face of the body. `motion`: a ParticleMotion; `team`: see feature_reaches.
template <class T, class Motion, class Add, class Team>
ATELIER_HOST_DEVICE inline PairState push_off_face(const FeatureStep<T>& step,
                                                   const PushedFaces<T>& faces, int face,
                                                   int body_face, const Motion& motion,
                                                   const Add& add, const Team& team) {
  if (faces.length[face] < step.features.least[body_face]) {
    return PairState::Apart;
  }
  const int bits = step.features.sharp[body_face];
  PairState most = PairState::Apart;
  const auto take = [&](PairState state) { most = state > most ? state : most; };
  for (int k = 0; k < 3; ++k) {
    if ((bits >> k & 1) != 0) {
      take(push_off_corner(step, face, step.features.corner_of[3 * body_face + k], motion, add,
                           team));
    }
    for (int own = 0; own < 3 && (bits >> (3 + k) & 1) != 0; ++own) {
      if (faces.edge_of[3 * face + own] >= 0) {
        take(push_off_edge(step, faces.edge_of[3 * face + own],
                           step.features.edge_of[3 * body_face + k], motion, add, team));
      }
    }
  }
  return most;
}

}  // namespace atelier
