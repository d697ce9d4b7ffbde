#include "registration/template/garment_boundaries.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "core/winding_number.h"

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

/// The leading points that the lines to the head and to both hands share.
Points trunk_of(const std::array<Points, 5>& axes) {
  Index shared = 0;
  const Index most =
      std::min({axes[kHead].rows(), axes[kLeftHand].rows(), axes[kRightHand].rows()});
  while (shared < most && axes[kHead].row(shared) == axes[kLeftHand].row(shared) &&
         axes[kHead].row(shared) == axes[kRightHand].row(shared)) {
    ++shared;
  }
  return axes[kHead].topRows(shared);
}

/// The lines through a body, and its points.
struct WornBody {
  std::array<Points, 5> axes;
  Points trunk;
  TriangleTree points;
  Points tips;  ///< of the fans over the loops
};

/// The cloth closed by a fan over each loop winds round a point of what it is worn by.
bool closes_round(const Points& vertices, const Triangles& faces,
                  const std::vector<std::vector<int>>& loops, const Points& tips,
                  const Eigen::RowVector3d& point) {
  Index fans = 0;
  for (const std::vector<int>& loop : loops) {
    fans += static_cast<Index>(loop.size());
  }
  Points closed(vertices.rows() + tips.rows(), 3);
  closed << vertices, tips;
  Triangles all(faces.rows() + fans, 3);
  all.topRows(faces.rows()) = faces;
  Index f = faces.rows();
  for (std::size_t b = 0; b < loops.size(); ++b) {
    for (std::size_t i = 0; i < loops[b].size(); ++i) {
      // A face across a rim runs along it the other way.
      all.row(f++) << loops[b][(i + 1) % loops[b].size()], loops[b][i],
          static_cast<int>(vertices.rows() + static_cast<Index>(b));
    }
  }
  return std::abs(winding_numbers(build_winding_tree(closed, all), point).front()) > 0.5;
}

/// The tip of the fan over each loop: its middle. A garment that is open in front or behind has one
/// rim all along, the middle of which may lie on the wrong side of the body: it is moved forwards
/// or backwards until the garment, closed by fans, is round the body.
Points fan_tips(const Points& vertices, const Triangles& faces,
                const std::vector<std::vector<int>>& loops, const Eigen::RowVector3d& inside,
                const Eigen::Vector3d& facing) {
  constexpr double kMoved = 2;  // m: nearly along the way that the body faces
  Points tips(static_cast<Index>(loops.size()), 3);
  Index longest = 0;
  for (std::size_t b = 0; b < loops.size(); ++b) {
    tips.row(static_cast<Index>(b)) = vertices(loops[b], Eigen::all).colwise().mean();
    longest = loops[b].size() > loops[static_cast<std::size_t>(longest)].size()
                  ? static_cast<Index>(b)
                  : longest;
  }
  if (loops.empty() || closes_round(vertices, faces, loops, tips, inside)) {
    return tips;
  }
  for (const double way : {kMoved, -kMoved}) {
    Points moved = tips;
    moved.row(longest) += way * facing.transpose();
    if (closes_round(vertices, faces, loops, moved, inside)) {
      return moved;
    }
  }
  return tips;
}

Passing passing_of(const Points& loop, const Eigen::Vector3d& tip, const WornBody& body,
                   const BodyAnatomy& anatomy) {
  Passing passing;
  for (std::size_t e = 0; e < body.axes.size(); ++e) {
    // The loop runs with the surface on its left: its fan looks into the garment.
    passing.through[e] = -crossings(loop, body.axes[e], tip);
  }
  if (const int trunk = -crossings(loop, body.trunk, tip); trunk != 0) {
    // Hands that come back past the loop are beyond it all the same.
    for (const std::size_t e : {kHead, kLeftHand, kRightHand}) {
      passing.through[e] = trunk;
    }
  }
  for (const std::size_t e : {kLeftHand, kRightHand}) {
    if (passing.through[e] != 0) {
      passing.round_arm = is_round_arm(loop, anatomy, e, body.points);
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
  if (left_foot && right_foot) {
    return head ? "free edge" : "hem";
  }
  if (head && !feet) {
    return left_hand && right_hand ? "waist" : "neck";
  }
  if (!head && !feet && left_hand != right_hand) {
    return std::string(passing.round_arm ? "cuff" : "armhole") + (left_hand ? " left" : " right");
  }
  if (!head && !left_hand && !right_hand && feet) {
    return left_foot ? "ankle left" : "ankle right";
  }
  return "opening";
}

constexpr const char* kHole = "";  // instead of a name

/// What a loop is in one pose.
std::string told_by(const Passing& passing, double largest_hole) {
  const bool nothing = std::all_of(passing.through.begin(), passing.through.end(),
                                   [](int through) { return through == 0; });
  return nothing && passing.length <= largest_hole ? kHole : name_of(passing);
}

/// What comes most often; the first of equals.
std::string most_often(const std::vector<std::string>& names) {
  std::string most;
  std::ptrdiff_t votes = 0;
  for (const std::string& name : names) {
    if (const auto count = std::count(names.begin(), names.end(), name); count > votes) {
      votes = count;
      most = name;
    }
  }
  return most;
}

}  // namespace

GarmentBoundaries garment_boundaries(const Points& vertices, const Triangles& faces,
                                     const BodyAnatomy& anatomy, const Points& body,
                                     const Triangles& body_faces, double largest_hole) {
  return garment_boundaries(faces, anatomy, body_faces, {{vertices, body}}, largest_hole);
}

GarmentBoundaries garment_boundaries(const Triangles& faces, const BodyAnatomy& anatomy,
                                     const Triangles& body_faces,
                                     const std::vector<WornPose>& poses, double largest_hole) {
  ATELIER_CHECK(!poses.empty(), "a pose");
  std::vector<std::vector<int>> loops =
      boundary_loops(topology_of(faces, poses.front().vertices.rows()));
  std::vector<WornBody> bodies(poses.size());
  for (std::size_t p = 0; p < poses.size(); ++p) {
    for (const Extremity extremity : kExtremities) {
      bodies[p].axes[static_cast<std::size_t>(extremity)] =
          limb_axis(anatomy, extremity, poses[p].body, body_faces);
    }
    bodies[p].trunk = trunk_of(bodies[p].axes);
    bodies[p].points = build_point_tree(poses[p].body);
    bodies[p].tips = fan_tips(poses[p].vertices, faces, loops, bodies[p].trunk.row(0),
                              body_facing(anatomy, poses[p].body));
  }
  struct Opening {
    std::vector<int> loop;
    std::string name;
    double length = 0;
  };
  GarmentBoundaries boundaries;
  std::vector<Opening> openings;
  for (std::size_t b = 0; b < loops.size(); ++b) {
    std::vector<int>& loop = loops[b];
    std::vector<std::string> names;
    double length = 0;
    for (std::size_t p = 0; p < poses.size(); ++p) {
      const Passing passing =
          passing_of(poses[p].vertices(loop, Eigen::all),
                     bodies[p].tips.row(static_cast<Index>(b)).transpose(), bodies[p], anatomy);
      names.push_back(told_by(passing, largest_hole));
      length = p == 0 ? passing.length : length;
    }
    std::string name = most_often(names);
    if (name == kHole) {
      boundaries.holes.push_back(std::move(loop));
    } else {
      openings.push_back({std::move(loop), std::move(name), length});
    }
  }
  // Hands that leave by openings of their own do not leave with the head, however low a neck is
  // cut.
  const auto has = [&](const char* end) {
    return std::any_of(openings.begin(), openings.end(),
                       [&](const Opening& one) { return one.name.ends_with(end); });
  };
  if (has("cuff left") + has("armhole left") > 0 && has("cuff right") + has("armhole right") > 0 &&
      !has("neck")) {
    for (Opening& opening : openings) {
      opening.name = opening.name == "waist" ? "neck" : opening.name;
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
