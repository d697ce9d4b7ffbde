#include "bodymodel/tracking/scan_agreement.h"

#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

constexpr Index kPoints = 4000;      // of the scan
constexpr double kSkinReach = 0.03;  // m
constexpr double kClothReach = 0.1;  // m
constexpr double kMinPart = 0.01;    // of the surface; less is judged with the joint above
constexpr double kMinJudged = 0.25;  // of a part, to say anything of it
constexpr double kMinNear =
    0.5;  // of what is judged of a part: 0.77 and more where poses are right
constexpr double kMaxOff = 0.03;  // of the scan: a hand is 2%, a forearm 3%

/// The sought joint that moves a vertex most.
int mover_of(const FittedPerson& person, Index vertex) {
  const SkinWeights& skin = person.model->skin;
  Index slot = 0;
  skin.weights.row(vertex).maxCoeff(&slot);
  int joint = skin.joints(vertex, slot);
  while (person.slots[static_cast<std::size_t>(joint)] < 0 && joint > 0) {
    joint = person.shaped.skeleton.parents[static_cast<std::size_t>(joint)];
  }
  return joint;
}

/// [V] the part of the body, by its joint, that each vertex is of; small ones are of the joint
/// above.
std::vector<int> parts_of(const FittedPerson& person, const Eigen::VectorXd& areas) {
  const std::vector<int>& parents = person.shaped.skeleton.parents;
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(static_cast<Index>(parents.size()));
  std::vector<int> parts;
  for (Index v = 0; v < areas.size(); ++v) {
    parts.push_back(mover_of(person, v));
    sums[parts.back()] += areas[v];
  }
  std::vector<int> joined(parents.size());
  for (int j = static_cast<int>(parents.size()) - 1; j >= 0; --j) {  // parents stand first
    const int above = parents[static_cast<std::size_t>(j)];
    const bool small = above >= 0 && sums[j] < kMinPart * areas.sum();
    joined[static_cast<std::size_t>(j)] = small ? above : j;
    if (small) {
      sums[above] += sums[j];
    }
  }
  for (int& part : parts) {
    while (joined[static_cast<std::size_t>(part)] != part) {
      part = joined[static_cast<std::size_t>(part)];
    }
  }
  return parts;
}

double reach_of(ScanPart part) {
  return part == ScanPart::Skin ? kSkinReach : kClothReach;
}
bool counts(ScanPart part) {
  return part == ScanPart::Skin || part == ScanPart::Cloth;
}

/// Areas of something, and how far it is from what it should be near.
struct Nearness {
  double area = 0;     // m2
  double judged = 0;   // m2 of it
  double near = 0;     // m2 of that
  double squares = 0;  // m4, squared distances of what is judged and not near, times areas

  void judge(double part, double squared_distance, double reach) {
    judged += part;
    if (squared_distance <= reach * reach) {
      near += part;
    } else {
      squares += part * squared_distance;
    }
  }
};

/// A tree over the vertices of a region; without nodes where there are none.
TriangleTree tree_of(const Points& vertices, const std::vector<char>& region) {
  std::vector<Index> inside;
  for (std::size_t v = 0; v < region.size(); ++v) {
    if (region[v] != 0) {
      inside.push_back(static_cast<Index>(v));
    }
  }
  return inside.empty() ? TriangleTree{} : build_point_tree(vertices(inside, Eigen::all));
}

/// The scan's points about the body. Clothing over the region is of it where it hangs beside it,
/// too: a hem swings to where another part of the body is a little nearer.
Nearness of_scan(const BodySurface& surface, const ScanPoints& points,
                 const std::vector<char>& region) {
  constexpr double kBeside = 1.5;  // times the distance of the nearest part of the body
  const TriangleTree left_out = tree_of(surface.vertices, region);
  Nearness result;
  for (Index i = 0; i < points.points.rows(); ++i) {
    const ScanPart part = points.parts[static_cast<std::size_t>(i)];
    if (!counts(part)) {
      continue;
    }
    const Eigen::Vector3d point = points.points.row(i).transpose();
    const double squared = closest_point(surface.tree, point).squared_distance;
    if (part == ScanPart::Skin || left_out.nodes.empty() ||
        closest_point(left_out, point, kBeside * std::sqrt(squared) + kSkinReach).face < 0) {
      result.judge(points.areas[i], squared, reach_of(part));
    }
  }
  return result;
}

/// Clothing that is left out.
struct LeftOut {
  Points points;
  Points normals;
  TriangleTree tree;  // without nodes where there is none
};

LeftOut left_out_of(const ScanPoints& scan) {
  std::vector<Index> rows;
  for (Index i = 0; i < scan.points.rows(); ++i) {
    if (scan.parts[static_cast<std::size_t>(i)] == ScanPart::LeftOut) {
      rows.push_back(i);
    }
  }
  LeftOut result;
  if (!rows.empty()) {
    result.points = scan.points(rows, Eigen::all);
    result.normals = scan.normals(rows, Eigen::all);
    result.tree = build_point_tree(result.points);
  }
  return result;
}

/// Whether a place lies behind it: its nearest point looks the other way. Past a hem that lies
/// sideways.
bool is_under(const LeftOut& cloth, const Eigen::Vector3d& place) {
  constexpr double kMinCosine = 0.7;
  if (cloth.tree.nodes.empty()) {
    return false;
  }
  const int nearest = closest_point(cloth.tree, place).face;
  const Eigen::Vector3d outwards = cloth.points.row(nearest).transpose() - place;
  return outwards.dot(cloth.normals.row(nearest)) > kMinCosine * outwards.norm();
}

/// [J] the parts of the body about the scan. What is under clothing left out is not judged unless
/// it is near something that counts: of a thigh under a skirt the nearest skin, the other hand's
/// or a calf's, says nothing.
std::vector<Nearness> of_parts(const FittedPerson& person, const BodySurface& surface,
                               const Eigen::VectorXd& areas, const ScanPoints& points,
                               const std::vector<char>& region) {
  const std::vector<ClosestPoint> nearest =
      closest_points(build_point_tree(points.points), surface.vertices);
  const std::vector<int> part_of = parts_of(person, areas);
  const LeftOut left_out = left_out_of(points);
  std::vector<Nearness> parts(person.slots.size());
  for (Index v = 0; v < areas.size(); ++v) {
    const auto i = static_cast<std::size_t>(v);
    Nearness& part = parts[static_cast<std::size_t>(part_of[i])];
    const ScanPart what = points.parts[static_cast<std::size_t>(nearest[i].face)];
    part.area += areas[v];
    if (!counts(what)) {
      continue;
    }
    const double squared = nearest[i].squared_distance;
    const bool near = squared <= reach_of(what) * reach_of(what);
    const bool over = !region.empty() && region[i] != 0;
    const bool bare = near && what == ScanPart::Skin;  // a hand beside the skirt that is left out
    if (bare || (!over && (near || !is_under(left_out, surface.vertices.row(v))))) {
      part.judge(areas[v], squared, reach_of(what));
    }
  }
  return parts;
}

}  // namespace

ScanAgreement scan_agreement(const FittedPerson& person, const BodySurface& surface,
                             const Eigen::VectorXd& areas, const ScanPoints& scan,
                             const std::vector<char>& region) {
  ATELIER_CHECK(areas.size() == surface.vertices.rows() &&
                    (region.empty() || static_cast<Index>(region.size()) == areas.size()),
                "an area for each vertex of the body");
  ScanAgreement result;
  const ScanPoints points = sampled(scan, kPoints);
  if (points.points.rows() == 0) {
    return result;
  }
  const Nearness seen = of_scan(surface, points, region);
  result.off = seen.judged > 0 ? 1 - seen.near / seen.judged : 1;
  double squares = seen.squares;
  double far = seen.judged - seen.near;

  const std::vector<Nearness> parts = of_parts(person, surface, areas, points, region);
  std::vector<char> held(parts.size(), 0);
  for (int j = static_cast<int>(parts.size()) - 1; j >= 0; --j) {
    const auto i = static_cast<std::size_t>(j);
    const Nearness& part = parts[i];
    const bool judged = part.judged > 0 && part.judged >= kMinJudged * part.area;
    const bool near = part.near >= kMinNear * part.judged;
    // Points that cannot be judged are inside if something further out is held.
    if (part.area > 0 && !(judged ? near : held[i] != 0)) {
      result.loose.push_back(j);
      squares += part.squares;
      far += part.judged - part.near;
    }
    held[i] = held[i] != 0 || (judged && near) ? 1 : 0;
    const int above = person.shaped.skeleton.parents[i];
    if (above >= 0 && held[i] != 0) {
      held[static_cast<std::size_t>(above)] = 1;
    }
  }
  result.apart = far > 0 ? std::sqrt(squares / far) : 0;
  result.holds = result.loose.empty() && result.off <= kMaxOff;
  return result;
}

}  // namespace atelier
