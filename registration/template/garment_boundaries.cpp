#include "registration/template/garment_boundaries.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

/// Passages through a loop: +1 from inside of the garment outwards, -1 into it.
struct Passing {
  std::array<int, 5> through{};  // as kExtremities
  bool round_arm = true;         // it lies on the arm itself, not at its root
  double length = 0;             // m, of the loop
};

constexpr std::size_t kHead = 0;
constexpr std::size_t kLeftHand = 1;
constexpr std::size_t kRightHand = 2;
constexpr std::size_t kLeftFoot = 3;
constexpr std::size_t kRightFoot = 4;
constexpr std::size_t kArmLumps = 3;  // upper arm, forearm, hand

/// Whether most of a loop is nearest to the last lumps of a limb.
bool is_round_arm(const Points& loop, const BodyAnatomy& anatomy, std::size_t arm,
                  const TriangleTree& body) {
  const std::vector<int>& limb = anatomy.limbs[arm];
  const auto first = limb.end() - static_cast<std::ptrdiff_t>(std::min(kArmLumps, limb.size()));
  Index on_arm = 0;
  for (const ClosestPoint& nearest : closest_points(body, loop)) {
    const int lump = anatomy.lumps[static_cast<std::size_t>(nearest.face)];
    on_arm += std::find(first, limb.end(), lump) != limb.end() ? 1 : 0;
  }
  return 2 * on_arm >= loop.rows();
}

Passing passing_of(const Points& loop, const std::array<Points, 5>& axes,
                   const BodyAnatomy& anatomy, const TriangleTree& body) {
  Passing passing;
  for (std::size_t e = 0; e < axes.size(); ++e) {
    // The loop runs with the surface on its left: its fan looks into the garment.
    passing.through[e] = -crossings(loop, axes[e]);
    if ((e == kLeftHand || e == kRightHand) && passing.through[e] != 0) {
      passing.round_arm = is_round_arm(loop, anatomy, e, body);
    }
  }
  for (Index i = 0; i < loop.rows(); ++i) {
    passing.length += (loop.row((i + 1) % loop.rows()) - loop.row(i)).norm();
  }
  return passing;
}

std::string name_of(const Passing& passing) {
  const std::array<int, 5>& t = passing.through;
  const bool out = *std::max_element(t.begin(), t.end()) > 0;
  const bool in = *std::min_element(t.begin(), t.end()) < 0;
  if (out == in) {
    return "opening";
  }
  const bool head = t[kHead] != 0;
  const bool left_hand = t[kLeftHand] != 0;
  const bool right_hand = t[kRightHand] != 0;
  const bool left_foot = t[kLeftFoot] != 0;
  const bool right_foot = t[kRightFoot] != 0;
  const bool feet = left_foot || right_foot;
  if (in) {  // the pelvis lies beyond
    return head && !feet ? "hem" : left_foot && right_foot && !head ? "waist" : "opening";
  }
  if (head && !feet) {
    return left_hand && right_hand ? "waist" : "neck";
  }
  if (!head && !feet && left_hand != right_hand) {
    return std::string(passing.round_arm ? "cuff" : "armhole") + (left_hand ? " left" : " right");
  }
  if (!head && !left_hand && !right_hand && feet) {
    return left_foot && right_foot ? "hem" : left_foot ? "ankle left" : "ankle right";
  }
  return "opening";
}

}  // namespace

GarmentBoundaries garment_boundaries(const Points& vertices, const Triangles& faces,
                                     const BodyAnatomy& anatomy, const Points& body,
                                     const Triangles& body_faces, double largest_hole) {
  std::array<Points, 5> axes;
  for (const Extremity extremity : kExtremities) {
    axes[static_cast<std::size_t>(extremity)] = limb_axis(anatomy, extremity, body, body_faces);
  }
  const TriangleTree body_points = build_point_tree(body);
  struct Opening {
    std::vector<int> loop;
    std::string name;
    double length = 0;
  };
  GarmentBoundaries boundaries;
  std::vector<Opening> openings;
  for (std::vector<int>& loop : boundary_loops(topology_of(faces, vertices.rows()))) {
    Points points(static_cast<Index>(loop.size()), 3);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      points.row(static_cast<Index>(i)) = vertices.row(loop[i]);
    }
    const Passing passing = passing_of(points, axes, anatomy, body_points);
    const bool nothing = std::all_of(passing.through.begin(), passing.through.end(),
                                     [](int through) { return through == 0; });
    if (nothing && passing.length <= largest_hole) {
      boundaries.holes.push_back(std::move(loop));
    } else {
      openings.push_back({std::move(loop), name_of(passing), passing.length});
    }
  }
  std::stable_sort(openings.begin(), openings.end(),
                   [](const Opening& a, const Opening& b) { return a.length > b.length; });
  std::map<std::string, int> count;
  for (Opening& opening : openings) {
    const int number = ++count[opening.name];
    boundaries.names.push_back(opening.name +
                               (number > 1 ? " " + std::to_string(number) : std::string()));
    boundaries.loops.push_back(std::move(opening.loop));
  }
  return boundaries;
}

std::vector<std::string> limbs_closed_over(const Points& vertices, const Triangles& faces,
                                           const BodyAnatomy& anatomy, const Points& body,
                                           const Triangles& body_faces) {
  constexpr std::array<const char*, 5> kNames = {"head", "left hand", "right hand", "left foot",
                                                 "right foot"};  // as kExtremities
  const TriangleTree cloth = build_tree(vertices, faces);
  const Points normals = face_normals(vertices, faces);
  std::vector<std::string> closed;
  for (const Extremity extremity : kExtremities) {
    const Points axis = limb_axis(anatomy, extremity, body, body_faces);
    int through = 0;
    for (Index i = 0; i + 1 < axis.rows(); ++i) {
      Ray ray;
      ray.origin = axis.row(i).transpose();
      ray.direction = (axis.row(i + 1) - axis.row(i)).transpose();
      ray.t_max = 1;
      if (ray.direction.isZero()) {
        continue;
      }
      for (RayHit hit = first_hit(cloth, ray); hit.face >= 0; hit = first_hit(cloth, ray)) {
        through += normals.row(hit.face).dot(ray.direction.transpose()) > 0 ? 1 : -1;
        ray.t_min = std::nextafter(hit.t, 2.0);
        if (ray.t_min > ray.t_max) {
          break;
        }
      }
    }
    if (through != 0) {
      closed.emplace_back(kNames[static_cast<std::size_t>(extremity)]);
    }
  }
  return closed;
}

}  // namespace atelier
