#include "simulation/contact/crossings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "simulation/contact/contact_tree.h"

namespace atelier {
namespace {

template <class T>
T volume_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& d, T* magnitude) {
  const T bx = T(b.x()) - T(a.x()), by = T(b.y()) - T(a.y()), bz = T(b.z()) - T(a.z());
  const T cx = T(c.x()) - T(a.x()), cy = T(c.y()) - T(a.y()), cz = T(c.z()) - T(a.z());
  const T dx = T(d.x()) - T(a.x()), dy = T(d.y()) - T(a.y()), dz = T(d.z()) - T(a.z());
  const T x1 = by * cz, x2 = bz * cy, y1 = bz * cx, y2 = bx * cz, z1 = bx * cy, z2 = by * cx;
  if (magnitude != nullptr) {
    *magnitude = (std::abs(x1) + std::abs(x2)) * std::abs(dx) +
                 (std::abs(y1) + std::abs(y2)) * std::abs(dy) +
                 (std::abs(z1) + std::abs(z2)) * std::abs(dz);
  }
  return (x1 - x2) * dx + (y1 - y2) * dy + (z1 - z2) * dz;
}

int sign(double v) {
  return v > 0 ? 1 : v < 0 ? -1 : 0;
}

/// Six times the signed volume of a b c d; computed again in long double where rounding could
/// change its sign.
double signed_volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& d) {
  double magnitude = 0;
  const double volume = volume_of<double>(a, b, c, d, &magnitude);
  // Bound on the rounding of the double expression (Shewchuk 1997, orient3d), generously rounded
  // up.
  if (std::abs(volume) > 1e-15 * magnitude) {
    return volume;
  }
  long double exact_magnitude = 0;
  const long double exact = volume_of<long double>(a, b, c, d, &exact_magnitude);
  return std::abs(exact) > 1e-18L * exact_magnitude ? static_cast<double>(exact) : 0.0;
}

/// Where a vertex lies in the plane of a face, or an edge meets the edge or the vertex of a face,
/// all edges count as shifted against all faces by an infinitely small step in this direction, with
/// which no mesh is aligned: one configuration for every pair, in which a passage is counted once
/// and not lost. What only touches may count as passing then.
const Eigen::Vector3d kShift(0.5772156649, 0.3010299957, 0.7598356856);

/// The side of the plane a b c, -1, 0 or 1, on which p lies; 0 only where a b c has no area.
int side_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& p, const Eigen::Vector3d& shift) {
  const int side = sign(signed_volume(a, b, c, p));
  return side != 0 ? side : sign((b - a).cross(c - a).dot(shift));
}

/// How the line p q passes the line a b, -1, 0 or 1; 0 only where they are parallel in one plane.
int turn_of(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
            const Eigen::Vector3d& b, const Eigen::Vector3d& shift) {
  const int turn = sign(signed_volume(p, q, a, b));
  return turn != 0 ? turn : sign((q - p).cross(b - a).dot(shift));
}

bool segment_crosses_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                              const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              const Eigen::Vector3d& c, const Eigen::Vector3d& shift) {
  if (side_of(a, b, c, p, shift) * side_of(a, b, c, q, shift) >= 0) {
    return false;
  }
  const int ab = turn_of(p, q, a, b, shift);
  return ab != 0 && ab == turn_of(p, q, b, c, shift) && ab == turn_of(p, q, c, a, shift);
}

ContactTree<double> tree_of(const Points& x, const Triangles& faces) {
  std::vector<Box<double>> boxes(static_cast<std::size_t>(faces.rows()));
  for (Index f = 0; f < faces.rows(); ++f) {
    Box<double> box = empty_box<double>();
    for (int c = 0; c < 3; ++c) {
      const auto p = x.row(faces(f, c));
      grow(box, Vec3d{p[0], p[1], p[2]});
    }
    boxes[f] = box;
  }
  return build_contact_tree(boxes);
}

struct Edge {
  int a, b;
};

std::vector<Edge> edges_of(const Triangles& faces) {
  std::vector<Edge> edges;
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = faces(f, c);
      const int b = faces(f, (c + 1) % 3);
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& l, const Edge& r) { return l.a != r.a ? l.a < r.a : l.b < r.b; });
  edges.erase(std::unique(edges.begin(), edges.end(),
                          [](const Edge& l, const Edge& r) { return l.a == r.a && l.b == r.b; }),
              edges.end());
  return edges;
}

/// Edges of one mesh, shifted, through the faces of another; `same` if it is the same mesh.
int edges_through(const Points& x, const Triangles& faces, const Points& y, const Triangles& other,
                  bool same, const Eigen::Vector3d& shift) {
  if (faces.rows() == 0 || other.rows() == 0) {
    return 0;
  }
  const ContactTree<double> tree = tree_of(y, other);
  const std::vector<Edge> edges = edges_of(faces);
  return parallel_sum(static_cast<Index>(edges.size()), 256, 0, [&](Index begin, Index end) {
    int count = 0;
    for (Index e = begin; e < end; ++e) {
      const Edge edge = edges[e];
      const Eigen::Vector3d p = x.row(edge.a).transpose();
      const Eigen::Vector3d q = x.row(edge.b).transpose();
      Box<double> box = empty_box<double>();
      grow(box, Vec3d{p.x(), p.y(), p.z()});
      grow(box, Vec3d{q.x(), q.y(), q.z()});
      visit_tree(tree.nodes.data(), box, [&](int f) {
        const Eigen::RowVector3i v = other.row(f);
        if (same && ((v.array() == edge.a).any() || (v.array() == edge.b).any())) {
          return;
        }
        count += segment_crosses_triangle(p, q, y.row(v[0]).transpose(), y.row(v[1]).transpose(),
                                          y.row(v[2]).transpose(), shift);
      });
    }
    return count;
  });
}

}  // namespace

int count_crossings(const Points& vertices, const Triangles& faces) {
  return edges_through(vertices, faces, vertices, faces, true, kShift);
}

int count_crossings(const Points& vertices, const Triangles& faces, const Points& other_vertices,
                    const Triangles& other_faces) {
  return edges_through(vertices, faces, other_vertices, other_faces, false, kShift) +
         edges_through(other_vertices, other_faces, vertices, faces, false, -kShift);
}

}  // namespace atelier
