#include "simulation/least_gap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/triangle_math.h"
#include "simulation/contact_tree.h"
#include "simulation/self_contact_math.h"

namespace atelier {
namespace {

/// A triangle with its corners' numbers.
using Face = Corners<double>;

Face face_of(const Points& x, const Triangles& faces, Index f) {
  const auto at = [&](int corner) {
    const auto p = x.row(faces(f, corner));
    return Vec3d{p[0], p[1], p[2]};
  };
  return {at(0), at(1), at(2), faces(f, 0), faces(f, 1), faces(f, 2)};
}

Box<double> box_of(const Face& face, double margin) {
  Box<double> box = empty_box<double>();
  for (const Vec3d& p : {face.a, face.b, face.c}) {
    grow(box, p - Vec3d{margin, margin, margin});
    grow(box, p + Vec3d{margin, margin, margin});
  }
  return box;
}

double squared_distance(const Face& one, const Face& other, bool same_mesh) {
  const Vec3d p[] = {one.a, one.b, one.c};
  const Vec3d q[] = {other.a, other.b, other.c};
  const int i[] = {one.ia, one.ib, one.ic};
  const int j[] = {other.ia, other.ib, other.ic};
  const auto same = [&](int a, int b) { return same_mesh && a == b; };
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (!same(i[k], j[0]) && !same(i[k], j[1]) && !same(i[k], j[2])) {
      least = std::min(least, nearest_on_triangle(p[k], other).squared_distance);
    }
    if (!same(j[k], i[0]) && !same(j[k], i[1]) && !same(j[k], i[2])) {
      least = std::min(least, nearest_on_triangle(q[k], one).squared_distance);
    }
    for (int l = 0; l < 3; ++l) {
      const int k1 = (k + 1) % 3;
      const int l1 = (l + 1) % 3;
      if (same(i[k], j[l]) || same(i[k], j[l1]) || same(i[k1], j[l]) || same(i[k1], j[l1])) {
        continue;
      }
      const SegmentShares<double> near = nearest_on_segments(p[k], p[k1], q[l], q[l1]);
      least = std::min(least,
                       squared_norm(between(p[k], p[k1], near.s) - between(q[l], q[l1], near.t)));
    }
  }
  return least;
}

double least_between(const Points& x, const Triangles& faces, const Points& y,
                     const Triangles& other, bool same_mesh, double reach) {
  if (faces.rows() == 0 || other.rows() == 0) {
    return reach;
  }
  std::vector<Box<double>> boxes;
  boxes.reserve(static_cast<std::size_t>(other.rows()));
  for (Index f = 0; f < other.rows(); ++f) {
    boxes.push_back(box_of(face_of(y, other, f), 0));
  }
  const ContactTree<double> tree = build_contact_tree(boxes);
  constexpr Index kChunk = 256;
  std::vector<double> least(static_cast<std::size_t>((faces.rows() + kChunk - 1) / kChunk),
                            reach * reach);
  parallel_for(faces.rows(), kChunk, [&](Index begin, Index end) {
    double& found = least[static_cast<std::size_t>(begin / kChunk)];
    for (Index f = begin; f < end; ++f) {
      const Face face = face_of(x, faces, f);
      visit_tree(tree.nodes.data(), box_of(face, std::sqrt(found)), [&](int g) {
        if (!same_mesh || g > f) {
          found = std::min(found, squared_distance(face, face_of(y, other, g), same_mesh));
        }
      });
    }
  });
  return std::sqrt(*std::min_element(least.begin(), least.end()));
}

}  // namespace

double least_gap(const Points& vertices, const Triangles& faces, double reach) {
  return least_between(vertices, faces, vertices, faces, true, reach);
}

double least_gap(const Points& vertices, const Triangles& faces, const Points& other_vertices,
                 const Triangles& other_faces, double reach) {
  return least_between(vertices, faces, other_vertices, other_faces, false, reach);
}

}  // namespace atelier
