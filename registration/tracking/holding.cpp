#include "registration/tracking/holding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/depths_inside.h"
#include "core/error.h"
#include "core/median.h"
#include "core/mesh_statistics.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/attach_to_body.h"

namespace atelier {
namespace {

constexpr int kReferenceFrames = 5;   // in which vertices choose their triangle
constexpr int kGapFrames = 12;        // in which distances from the body are measured
constexpr int kMinRing = 6;           // vertices of a ring
constexpr double kSteadyShare = 0.8;  // of the frames, in which a vertex is where it is told to be
constexpr double kShoulderBelow = 0.15;  // m below the garment's top, where it lies on shoulders
constexpr double kShoulderNormal = 0.6;  // upward part of the skin's normal
constexpr double kShoulderShare = 0.1;   // of the vertices there
constexpr double kShoulderGap = 0.03;    // m
constexpr double kEdgeAllRound = 0.25;   // m, height of a loop that is no opening of its own
constexpr double kUpperRun = 0.08;       // m below the top of such a loop
constexpr double kFriction = 0.4;
constexpr double kSafety = 3;
constexpr double kGravity = 9.81;       // m/s2
constexpr double kMinStiffness = 20;    // N
constexpr double kSteadyOfTight = 0.6;  // of `steady`, for rings that need not be there

std::vector<Index> spread_rows(Index count, int most) {
  const Index wanted = std::min<Index>(count, most);
  std::vector<Index> rows;
  for (Index i = 0; i < wanted; ++i) {
    rows.push_back(wanted == 1 ? count / 2 : i * (count - 1) / (wanted - 1));
  }
  return rows;
}

/// Value below which `share` of the values are; 0 of none.
double quantile_of(std::vector<double> values, double share) {
  if (values.empty()) {
    return 0;
  }
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Some frames of a take, read once.
struct Take {
  std::vector<Points> cloth;
  std::vector<Points> body;
};

Take read_take(const FollowedGarment& garment, const HoldingOptions& options) {
  Take take;
  for (const Index row : spread_rows(garment.frames, options.frames)) {
    take.cloth.push_back(garment.cloth(row));
    take.body.push_back(garment.body(row));
    ATELIER_CHECK(take.cloth.back().rows() == take.cloth.front().rows() &&
                      take.body.back().rows() == take.body.front().rows(),
                  "a frame of another mesh");
  }
  return take;
}

/// A point seen from a triangle that moves.
Eigen::Vector3d seen_from(const Attachment& attachment, const Eigen::Vector3d& point,
                          const Points& body, const Triangles& faces) {
  const Eigen::Vector3d a = body.row(faces(attachment.triangle, 0));
  const Eigen::Vector3d b = body.row(faces(attachment.triangle, 1));
  const Eigen::Vector3d c = body.row(faces(attachment.triangle, 2));
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  const Eigen::Vector3d along = (b - a).normalized();
  const Eigen::Vector3d across = normal.cross(along);
  const Eigen::Vector3d& w = attachment.barycentric;
  const Eigen::Vector3d off =
      point - (w[0] * a + w[1] * b + w[2] * c + attachment.distance * normal);
  return {off.dot(along), off.dot(across), off.dot(normal)};
}

/// By how much each vertex changes its place on the body, m (find_holding).
std::vector<double> deviations(const Take& take, const Triangles& body_faces) {
  const auto frames = take.cloth.size();
  const Index count = take.cloth.front().rows();
  std::vector<double> least(static_cast<std::size_t>(count),
                            std::numeric_limits<double>::infinity());
  for (const Index reference : spread_rows(static_cast<Index>(frames), kReferenceFrames)) {
    const auto r = static_cast<std::size_t>(reference);
    const std::vector<Attachment> places = attach_to_body(take.cloth[r], take.body[r], body_faces);
    for (Index v = 0; v < count; ++v) {
      const Attachment& place = places[static_cast<std::size_t>(v)];
      std::array<std::vector<double>, 3> seen;
      for (std::size_t t = 0; t < frames; ++t) {
        const Eigen::Vector3d off =
            seen_from(place, take.cloth[t].row(v).transpose(), take.body[t], body_faces);
        for (int k = 0; k < 3; ++k) {
          seen[static_cast<std::size_t>(k)].push_back(off[k]);
        }
      }
      const Eigen::Vector3d middle(median(seen[0]), median(seen[1]), median(seen[2]));
      std::vector<double> away;
      for (std::size_t t = 0; t < frames; ++t) {
        away.push_back((Eigen::Vector3d(seen[0][t], seen[1][t], seen[2][t]) - middle).norm());
      }
      double& best = least[static_cast<std::size_t>(v)];
      best = std::min(best, quantile_of(std::move(away), kSteadyShare));
    }
  }
  return least;
}

/// A ring that may hold the garment, and what frames say of it.
struct RingCandidate {
  std::size_t opening = 0;
  std::vector<int> vertices;
  bool closed = true;
  int inside = 0;  ///< frames in which its middle is inside the body
  std::vector<double> girths = {};
  std::vector<double> body_girths = {};
  std::vector<double> gaps = {};
  std::vector<double> heights = {};
  double deviation = 0;

  double gap() const { return median(gaps); }
  double height() const { return median(heights); }
  bool goes_round() const { return 2 * inside > static_cast<int>(girths.size()); }
  double tightness() const { return median(girths) / std::max(median(body_girths), 1e-6); }
};

double length_of(const std::vector<int>& ring, const Points& at, bool closed = true) {
  double length = 0;
  for (std::size_t i = 0; i + (closed ? 0 : 1) < ring.size(); ++i) {
    length += (at.row(ring[i]) - at.row(ring[(i + 1) % ring.size()])).norm();
  }
  return length;
}

/// Triangles with no corner in the ring.
Triangles without_ring(const Triangles& faces, const std::vector<int>& ring, Index vertices) {
  std::vector<char> in_ring(static_cast<std::size_t>(vertices), 0);
  for (const int v : ring) {
    in_ring[static_cast<std::size_t>(v)] = 1;
  }
  Triangles left(faces.rows(), 3);
  Index count = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    if (!in_ring[faces(f, 0)] && !in_ring[faces(f, 1)] && !in_ring[faces(f, 2)]) {
      left.row(count++) = faces.row(f);
    }
  }
  left.conservativeResize(count, 3);
  return left;
}

/// The loop of an opening, and rings beneath it, one triangle deeper each.
std::vector<std::vector<int>> rings_at(const FollowedGarment& garment, std::size_t opening,
                                       const Points& at, double depth) {
  const Index vertices = at.rows();
  std::vector<char> of_others(static_cast<std::size_t>(vertices), 0);
  for (std::size_t b = 0; b < garment.boundaries.size(); ++b) {
    for (const int v : garment.boundaries[b]) {
      of_others[static_cast<std::size_t>(v)] = b == opening ? 0 : 1;
    }
  }
  std::vector<std::vector<int>> rings = {garment.boundaries[opening]};
  const double edge = length_of(rings[0], at) / static_cast<double>(rings[0].size());
  Triangles left = garment.faces;
  const auto steps = edge > 0 ? static_cast<int>(depth / edge) : 0;
  constexpr int kMostSteps = 12;
  for (int step = 0; step < std::min(steps, kMostSteps); ++step) {
    left = without_ring(left, rings.back(), vertices);
    std::vector<int> longest;
    for (std::vector<int>& loop : boundary_loops(topology_of(left, vertices))) {
      const bool other = std::any_of(loop.begin(), loop.end(), [&](int v) {
        return of_others[static_cast<std::size_t>(v)] != 0;
      });
      if (!other && length_of(loop, at) > length_of(longest, at)) {
        longest = std::move(loop);
      }
    }
    if (longest.size() < kMinRing) {
      break;
    }
    rings.push_back(std::move(longest));
  }
  return rings;
}

/// The upper run of a loop that is an edge all round, as of a robe or of a skirt that wraps: neck,
/// fronts and hem. Empty where the loop is an opening of its own, or its top is in pieces.
std::vector<int> upper_run(const std::vector<int>& loop, const Points& at) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const int v : loop) {
    low = std::min(low, at(v, 1));
    high = std::max(high, at(v, 1));
  }
  if (high - low < kEdgeAllRound) {
    return {};
  }
  const std::size_t n = loop.size();
  std::vector<int> longest;
  for (std::size_t start = 0; start < n; ++start) {
    const auto upper = [&](std::size_t i) { return at(loop[i % n], 1) > high - kUpperRun; };
    if (!upper(start) || upper(start + n - 1)) {
      continue;
    }
    std::vector<int> run;
    for (std::size_t i = start; upper(i) && run.size() < n; ++i) {
      run.push_back(loop[i % n]);
    }
    if (run.size() > longest.size()) {
      longest = std::move(run);
    }
  }
  return longest;
}

std::vector<RingCandidate> candidates_of(const FollowedGarment& garment, const Points& at,
                                         const HoldingOptions& options) {
  std::vector<RingCandidate> all;
  for (std::size_t b = 0; b < garment.boundaries.size(); ++b) {
    if (garment.boundaries[b].size() < kMinRing) {
      continue;
    }
    if (std::vector<int> run = upper_run(garment.boundaries[b], at); !run.empty()) {
      all.push_back({.opening = b, .vertices = std::move(run), .closed = false});
      continue;
    }
    for (std::vector<int>& ring : rings_at(garment, b, at, options.band_below)) {
      all.push_back({.opening = b, .vertices = std::move(ring)});
    }
  }
  return all;
}

/// How much of the cloth near the garment's top lies on skin that looks up.
double share_on_shoulders(const Points& cloth, const std::vector<ClosestPoint>& nearest,
                          const Points& body, const Triangles& body_faces) {
  const double top = cloth.col(1).maxCoeff();
  double near_top = 0;
  double lying = 0;
  for (Index v = 0; v < cloth.rows(); ++v) {
    if (cloth(v, 1) < top - kShoulderBelow) {
      continue;
    }
    near_top += 1;
    const ClosestPoint& place = nearest[static_cast<std::size_t>(v)];
    const Eigen::Vector3d a = body.row(body_faces(place.face, 0));
    const Eigen::Vector3d b = body.row(body_faces(place.face, 1));
    const Eigen::Vector3d c = body.row(body_faces(place.face, 2));
    const bool looks_up = (b - a).cross(c - a).normalized().y() > kShoulderNormal;
    lying += looks_up && place.squared_distance < kShoulderGap * kShoulderGap ? 1 : 0;
  }
  return lying / std::max(near_top, 1.0);
}

/// Measures the rings against the body in some frames; whether the garment lies on the shoulders.
bool measure_rings(const Take& take, const Triangles& body_faces,
                   std::vector<RingCandidate>& candidates) {
  std::vector<double> shares;
  for (const Index row : spread_rows(static_cast<Index>(take.cloth.size()), kGapFrames)) {
    const Points& cloth = take.cloth[static_cast<std::size_t>(row)];
    const Points& body = take.body[static_cast<std::size_t>(row)];
    const std::vector<ClosestPoint> nearest = closest_points(build_tree(body, body_faces), cloth);
    shares.push_back(share_on_shoulders(cloth, nearest, body, body_faces));
    Points middles(static_cast<Index>(candidates.size()), 3);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      RingCandidate& one = candidates[c];
      Points feet(static_cast<Index>(one.vertices.size()), 3);
      std::vector<int> rows;
      std::vector<double> gaps;
      Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
      for (std::size_t i = 0; i < one.vertices.size(); ++i) {
        const auto v = static_cast<std::size_t>(one.vertices[i]);
        feet.row(static_cast<Index>(i)) = nearest[v].point.transpose();
        gaps.push_back(std::sqrt(nearest[v].squared_distance));
        middle += cloth.row(one.vertices[i]) / static_cast<double>(one.vertices.size());
        rows.push_back(static_cast<int>(i));
      }
      one.girths.push_back(length_of(one.vertices, cloth, one.closed));
      one.body_girths.push_back(length_of(rows, feet, one.closed));
      one.gaps.push_back(median(std::move(gaps)));
      one.heights.push_back(middle.y());
      middles.row(static_cast<Index>(c)) = middle;
    }
    const Eigen::VectorXd depths = depths_inside(middles, body, body_faces);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      candidates[c].inside += depths[static_cast<Index>(c)] > 0 ? 1 : 0;
    }
  }
  return median(std::move(shares)) > kShoulderShare;
}

HeldRing held_ring(const FollowedGarment& garment, const RingCandidate& one, HoldingKind kind,
                   double weight, const HoldingOptions& options) {
  HeldRing ring;
  ring.garment = garment.name;
  ring.opening = one.opening < garment.boundary_names.size() ? garment.boundary_names[one.opening]
                                                             : std::string("opening");
  ring.kind = kind;
  ring.closed = one.closed;
  ring.vertices = one.vertices;
  ring.girth = median(one.girths);
  ring.body_girth = median(one.body_girths);
  ring.gap = one.gap();
  ring.deviation = one.deviation;
  if (kind == HoldingKind::Band) {
    constexpr double kLeastShare = 0.1;  // of the frames: one with a wrong body does not count
    ring.rest_girth = options.pull * std::min(quantile_of(one.body_girths, kLeastShare),
                                              quantile_of(one.girths, kLeastShare));
    const double tension = kSafety * weight / (2 * std::numbers::pi * kFriction);
    ring.stiffness = std::max(kMinStiffness, tension / (1 / options.pull - 1));
  }
  return ring;
}

/// Of each opening the first ring, from its edge down, that `taken` takes.
template <typename Taken>
std::vector<const RingCandidate*> best_rings(const std::vector<RingCandidate>& candidates,
                                             const Taken& taken) {
  std::vector<const RingCandidate*> best;
  for (const RingCandidate& one : candidates) {
    if (!taken(one)) {
      continue;
    }
    if (best.empty() || best.back()->opening != one.opening) {
      best.push_back(&one);
    }
  }
  return best;
}

const RingCandidate* highest_of(const std::vector<const RingCandidate*>& rings) {
  const auto found = std::max_element(
      rings.begin(), rings.end(),
      [](const RingCandidate* a, const RingCandidate* b) { return a->height() < b->height(); });
  return found == rings.end() ? nullptr : *found;
}

}  // namespace

std::vector<HeldRing> find_holding(const FollowedGarment& garment, const HoldingOptions& options) {
  ATELIER_CHECK(garment.frames > 0 && options.frames > 0, "a garment in no frame");
  const Take take = read_take(garment, options);
  std::vector<RingCandidate> candidates = candidates_of(garment, take.cloth.front(), options);
  if (candidates.empty()) {
    return {};
  }
  const std::vector<double> deviation = deviations(take, garment.body_faces);
  for (RingCandidate& one : candidates) {
    std::vector<double> of_ring;
    for (const int v : one.vertices) {
      of_ring.push_back(deviation[static_cast<std::size_t>(v)]);
    }
    one.deviation = median(std::move(of_ring));
  }
  const bool on_shoulders = measure_rings(take, garment.body_faces, candidates);
  const bool moves = quantile_of(deviation, 0.9) > options.moving;
  const double weight =
      kGravity * options.areal_density * face_areas(take.cloth.front(), garment.faces).sum();
  const auto steady = [&](const RingCandidate& one) {
    return moves && one.goes_round() && one.deviation < options.steady && one.gap() < options.near;
  };
  const RingCandidate* highest = highest_of(best_rings(candidates, [&](const RingCandidate& one) {
    return one.goes_round() && one.gap() < options.far;
  }));
  if (on_shoulders && highest == nullptr) {  // a hood or a cowl stands far off
    highest = highest_of(best_rings(candidates, [](const RingCandidate&) { return true; }));
  }
  const std::vector<const RingCandidate*> held = best_rings(candidates, steady);
  const RingCandidate* first = on_shoulders ? nullptr : highest_of(held);
  // What is steady far below the top, as a cuff is, does not hold a garment whose top is free.
  if (!on_shoulders && highest != nullptr &&
      (first == nullptr || first->opening != highest->opening)) {
    first = highest;
  }
  std::vector<HeldRing> rings;
  if (on_shoulders && highest != nullptr) {
    rings.push_back(held_ring(garment, *highest, HoldingKind::Rest, weight, options));
  }
  if (first != nullptr) {
    rings.push_back(held_ring(garment, *first, HoldingKind::Band, weight, options));
  }
  for (const RingCandidate* one : held) {
    const bool known = (first != nullptr && one->opening == first->opening) ||
                       (on_shoulders && highest != nullptr && one->opening == highest->opening);
    if (!known && one->closed && one->deviation < kSteadyOfTight * options.steady &&
        one->tightness() < options.tight) {
      rings.push_back(held_ring(garment, *one, HoldingKind::Rest, weight, options));
    }
  }
  return rings;
}

}  // namespace atelier
