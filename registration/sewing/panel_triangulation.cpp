#include "registration/sewing/panel_triangulation.h"

#include <cmath>
#include <deque>
#include <vector>

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include "core/error.h"

namespace atelier {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using FaceInfo = CGAL::Triangulation_face_base_with_info_2<int, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel, FaceInfo>;
using DataStructure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, DataStructure,
                                               CGAL::No_constraint_intersection_tag>;
using Vector2 = Eigen::Vector2d;

constexpr int kUnknown = -1;
constexpr int kOutside = 0;
constexpr int kInsideCorner = 1;

// Inside is what an odd number of outline crossings separates from infinity; the outline is simple,
// so one flood from outside is enough.
void mark_outside(Triangulation& triangulation) {
  for (const auto face : triangulation.all_face_handles()) {
    face->info() = kUnknown;
  }
  std::deque<Triangulation::Face_handle> queue = {triangulation.infinite_face()};
  triangulation.infinite_face()->info() = kOutside;
  while (!queue.empty()) {
    const auto face = queue.front();
    queue.pop_front();
    for (int i = 0; i < 3; ++i) {
      const auto neighbor = face->neighbor(i);
      if (neighbor->info() == kUnknown && !triangulation.is_constrained({face, i})) {
        neighbor->info() = kOutside;
        queue.push_back(neighbor);
      }
    }
  }
  for (const auto face : triangulation.all_face_handles()) {
    if (face->info() == kUnknown) {
      face->info() = kInsideCorner;
    }
  }
}

Triangles delaunay(const std::vector<Vector2>& points, Index outline_count) {
  Triangulation triangulation;
  std::vector<Triangulation::Vertex_handle> handles;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto handle = triangulation.insert({points[i].x(), points[i].y()});
    handle->info() = static_cast<int>(i);
    handles.push_back(handle);
  }
  if (triangulation.number_of_vertices() != points.size()) {
    throw DataError("", "outline", "two points at one place", "different points");
  }
  try {
    for (Index i = 0; i < outline_count; ++i) {
      triangulation.insert_constraint(handles[static_cast<std::size_t>(i)],
                                      handles[static_cast<std::size_t>((i + 1) % outline_count)]);
    }
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    throw DataError("", "outline", "an outline that crosses itself", "a simple loop");
  }
  mark_outside(triangulation);
  std::vector<int> corners;
  for (const auto face : triangulation.finite_face_handles()) {
    if (face->info() == kInsideCorner) {
      for (int i = 0; i < 3; ++i) {
        corners.push_back(face->vertex(i)->info());
      }
    }
  }
  return Eigen::Map<const Triangles>(corners.data(), static_cast<Index>(corners.size() / 3), 3);
}

double distance_to_segment(const Vector2& p, const Vector2& a, const Vector2& b) {
  const Vector2 ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

bool inside(const Vector2& p, const Points2& outline) {
  bool odd = false;
  for (Index i = 0, j = outline.rows() - 1; i < outline.rows(); j = i++) {
    if ((outline(i, 1) > p.y()) != (outline(j, 1) > p.y()) &&
        p.x() < (outline(j, 0) - outline(i, 0)) * (p.y() - outline(i, 1)) /
                        (outline(j, 1) - outline(i, 1)) +
                    outline(i, 0)) {
      odd = !odd;
    }
  }
  return odd;
}

std::vector<Vector2> lattice(const Points2& outline, double edge_length) {
  const Vector2 low = outline.colwise().minCoeff();
  const Vector2 high = outline.colwise().maxCoeff();
  const double row_height = edge_length * std::sqrt(3.0) / 2;
  const double clearance = 0.6 * edge_length;
  std::vector<Vector2> points;
  int row = 0;
  for (double y = low.y() + row_height; y < high.y(); y += row_height, ++row) {
    const double shift = row % 2 == 0 ? 0 : edge_length / 2;
    for (double x = low.x() + shift; x < high.x(); x += edge_length) {
      const Vector2 p(x, y);
      if (!inside(p, outline)) {
        continue;
      }
      double nearest = edge_length;
      for (Index i = 0, j = outline.rows() - 1; i < outline.rows(); j = i++) {
        nearest = std::min(nearest, distance_to_segment(p, outline.row(j), outline.row(i)));
      }
      if (nearest >= clearance) {
        points.push_back(p);
      }
    }
  }
  return points;
}

}  // namespace

FlatMesh triangulate_outline(const Points2& outline, double edge_length) {
  ATELIER_CHECK(edge_length > 0, "triangulate_outline needs a positive edge length");
  if (outline.rows() < 3 || !outline.allFinite()) {
    throw DataError("", "outline", std::to_string(outline.rows()) + " points",
                    "at least 3, all finite");
  }
  const Index outline_count = outline.rows();
  std::vector<Vector2> points;
  for (Index i = 0; i < outline_count; ++i) {
    points.emplace_back(outline.row(i).transpose());
  }
  const std::vector<Vector2> inner = lattice(outline, edge_length);
  points.insert(points.end(), inner.begin(), inner.end());

  Triangles faces = delaunay(points, outline_count);
  constexpr int kRelaxations = 5;  // enough for the lattice to settle along the outline
  for (int round = 0; round < kRelaxations; ++round) {
    std::vector<Vector2> sum(points.size(), Vector2::Zero());
    std::vector<int> degree(points.size(), 0);
    for (Index face = 0; face < faces.rows(); ++face) {
      for (int i = 0; i < 3; ++i) {
        const auto a = static_cast<std::size_t>(faces(face, i));
        const auto b = static_cast<std::size_t>(faces(face, (i + 1) % 3));
        sum[a] += points[b];  // an inner vertex sees each neighbour once this way
        ++degree[a];
      }
    }
    for (std::size_t i = static_cast<std::size_t>(outline_count); i < points.size(); ++i) {
      if (degree[i] > 0) {
        points[i] = sum[i] / degree[i];
      }
    }
    faces = delaunay(points, outline_count);
  }
  FlatMesh mesh;
  mesh.vertices.resize(static_cast<Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    mesh.vertices.row(static_cast<Index>(i)) = points[i].transpose();
  }
  mesh.faces = std::move(faces);
  if (mesh.faces.rows() == 0) {
    throw DataError("", "outline", "no area", "a counter-clockwise loop round an area");
  }
  return mesh;
}

}  // namespace atelier
