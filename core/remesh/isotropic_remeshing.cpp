#include "core/remesh/isotropic_remeshing.h"

#include <array>
#include <utility>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include "core/error.h"

namespace atelier {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace processing = CGAL::Polygon_mesh_processing;

}  // namespace

Mesh isotropic_remeshing(const Mesh& surface, const RemeshingOptions& options) {
  check_mesh(surface);
  ATELIER_CHECK(options.edge_length > 0, "an edge length > 0");
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> polygons;
  for (Index i = 0; i < surface.vertices.rows(); ++i) {
    points.emplace_back(surface.vertices(i, 0), surface.vertices(i, 1), surface.vertices(i, 2));
  }
  for (Index i = 0; i < surface.faces.rows(); ++i) {
    polygons.push_back({static_cast<std::size_t>(surface.faces(i, 0)),
                        static_cast<std::size_t>(surface.faces(i, 1)),
                        static_cast<std::size_t>(surface.faces(i, 2))});
  }
  processing::orient_polygon_soup(points, polygons);
  if (!processing::is_polygon_soup_a_polygon_mesh(polygons)) {
    throw DataError("", "surface", "no orientable manifold", "one, to be remeshed");
  }
  SurfaceMesh mesh;
  processing::polygon_soup_to_polygon_mesh(points, polygons, mesh);
  processing::remove_isolated_vertices(mesh);
  for (const std::vector<int>& hole : options.holes) {
    // Vertices keep their numbers: garbage is not collected before.
    const SurfaceMesh::Vertex_index from(static_cast<SurfaceMesh::size_type>(hole[0]));
    const SurfaceMesh::Vertex_index to(static_cast<SurfaceMesh::size_type>(hole[1]));
    SurfaceMesh::Halfedge_index rim = mesh.halfedge(from, to);
    if (rim != SurfaceMesh::null_halfedge() && !mesh.is_border(rim)) {
      rim = mesh.opposite(rim);
    }
    if (rim == SurfaceMesh::null_halfedge() || !mesh.is_border(rim)) {
      continue;
    }
    std::vector<SurfaceMesh::Face_index> patch;
    std::vector<SurfaceMesh::Vertex_index> inner;
    processing::triangulate_refine_and_fair_hole(mesh, rim, std::back_inserter(patch),
                                                 std::back_inserter(inner));
  }
  mesh.collect_garbage();
  processing::isotropic_remeshing(
      faces(mesh), options.edge_length, mesh,
      CGAL::parameters::number_of_iterations(static_cast<unsigned>(options.rounds))
          .number_of_relaxation_steps(static_cast<unsigned>(options.relaxations))
          .protect_constraints(false)
          .relax_constraints(options.rims_relax));
  processing::remove_isolated_vertices(mesh);
  mesh.collect_garbage();
  Mesh result;
  result.vertices.resize(static_cast<Index>(mesh.number_of_vertices()), 3);
  result.faces.resize(static_cast<Index>(mesh.number_of_faces()), 3);
  for (const auto vertex : mesh.vertices()) {
    const Kernel::Point_3& point = mesh.point(vertex);
    result.vertices.row(static_cast<Index>(vertex.idx())) << point.x(), point.y(), point.z();
  }
  for (const auto face : mesh.faces()) {
    int k = 0;
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face))) {
      result.faces(static_cast<Index>(face.idx()), k++) = static_cast<int>(vertex.idx());
    }
  }
  return result;
}

}  // namespace atelier
