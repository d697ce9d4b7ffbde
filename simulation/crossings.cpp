#include "simulation/crossings.h"

#include <algorithm>
#include <vector>

#include "core/intersection.h"
#include "core/parallel.h"
#include "simulation/contact_tree.h"

namespace atelier {
namespace {

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

/// Edges of one mesh through the faces of another; `same` if it is the same mesh.
int edges_through(const Points& x, const Triangles& faces, const Points& y, const Triangles& other,
                  bool same) {
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
                                          y.row(v[2]).transpose());
      });
    }
    return count;
  });
}

}  // namespace

int count_crossings(const Points& vertices, const Triangles& faces) {
  return edges_through(vertices, faces, vertices, faces, true);
}

int count_crossings(const Points& vertices, const Triangles& faces, const Points& other_vertices,
                    const Triangles& other_faces) {
  return edges_through(vertices, faces, other_vertices, other_faces, false) +
         edges_through(other_vertices, other_faces, vertices, faces, false);
}

}  // namespace atelier
