#include <array>
#include <vector>

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include "capture/surface/surface_from_points.h"
#include "core/error.h"

namespace atelier {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace processing = CGAL::Polygon_mesh_processing;

constexpr unsigned kRounds = 3;

}  // namespace

Mesh evenly_remeshed(const Mesh& mesh, double edge_length) {
  check_mesh(mesh);
  ATELIER_CHECK(edge_length > 0, "an edge length > 0");
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> polygons;
  for (Index i = 0; i < mesh.vertices.rows(); ++i) {
    points.emplace_back(mesh.vertices(i, 0), mesh.vertices(i, 1), mesh.vertices(i, 2));
  }
  for (Index i = 0; i < mesh.faces.rows(); ++i) {
    polygons.push_back({static_cast<std::size_t>(mesh.faces(i, 0)),
                        static_cast<std::size_t>(mesh.faces(i, 1)),
                        static_cast<std::size_t>(mesh.faces(i, 2))});
  }
  // Trimming can leave faces that touch in one vertex: it is doubled there.
  if (!processing::orient_polygon_soup(points, polygons) &&
      !processing::is_polygon_soup_a_polygon_mesh(polygons)) {
    throw DataError("", "mesh", "no orientable manifold", "one, to be remeshed");
  }
  SurfaceMesh surface;
  processing::polygon_soup_to_polygon_mesh(points, polygons, surface);
  processing::remove_isolated_vertices(surface);
  surface.collect_garbage();
  processing::isotropic_remeshing(
      faces(surface), edge_length, surface,
      CGAL::parameters::number_of_iterations(kRounds).protect_constraints(false));
  surface.collect_garbage();
  Mesh result;
  result.vertices.resize(static_cast<Index>(surface.number_of_vertices()), 3);
  result.faces.resize(static_cast<Index>(surface.number_of_faces()), 3);
  for (const auto vertex : surface.vertices()) {
    const Kernel::Point_3& point = surface.point(vertex);
    result.vertices.row(static_cast<Index>(vertex.idx())) << point.x(), point.y(), point.z();
  }
  for (const auto face : surface.faces()) {
    int k = 0;
    for (const auto vertex : surface.vertices_around_face(surface.halfedge(face))) {
      result.faces(static_cast<Index>(face.idx()), k++) = static_cast<int>(vertex.idx());
    }
  }
  return result;
}

}  // namespace atelier
