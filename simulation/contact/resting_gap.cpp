#include "simulation/contact/resting_gap.h"

#include <algorithm>
#include <vector>

#include "core/normals.h"
#include "core/tree.h"

namespace atelier {

double resting_gap(const Points& cloth, const Points& body, const Triangles& body_faces,
                   double otherwise) {
  constexpr double kUp = 0.7;
  constexpr double kNear = 0.02;      // m
  constexpr double kMinShare = 0.01;  // of the vertices, but
  constexpr double kEnough = 20;      // of them say it
  const Points normals = face_normals(body, body_faces);
  std::vector<double> gaps;
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(body, body_faces), cloth, kNear);
  for (Index v = 0; v < cloth.rows(); ++v) {
    const ClosestPoint& skin = nearest[static_cast<std::size_t>(v)];
    if (skin.face < 0 || normals(skin.face, 1) <= kUp) {
      continue;
    }
    const Eigen::RowVector3d off = cloth.row(v) - skin.point.transpose();
    const double gap = off.norm();
    gaps.push_back(off.dot(normals.row(skin.face)) < 0 ? -gap : gap);
  }
  const double least = std::min(kEnough, kMinShare * static_cast<double>(cloth.rows()));
  if (gaps.empty() || static_cast<double>(gaps.size()) < least) {
    return otherwise;
  }
  const auto quartile = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 4);
  std::nth_element(gaps.begin(), quartile, gaps.end());
  return *quartile;
}

}  // namespace atelier
