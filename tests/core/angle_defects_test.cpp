// Angle defects and means over neighbours.

#include "core/angle_defects.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/neighbor_means.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

Topology topology_in(const Mesh& mesh) {
  return topology_of(mesh.faces, mesh.vertices.rows());
}

TEST(AngleDefects, ClosedSurface_SumToItsEulerCharacteristic) {
  // Gauss and Bonnet: 2 pi times it.
  for (const Mesh& mesh : {fixtures::sphere(2), fixtures::torus(12, 8), fixtures::tetrahedron()}) {
    const Topology topology = topology_in(mesh);
    const std::vector<double> defects = angle_defects(mesh.vertices, topology);
    EXPECT_NEAR(std::accumulate(defects.begin(), defects.end(), 0.0),
                2 * std::numbers::pi * euler_characteristic(topology), 1e-9);
  }
  for (const double defect :
       angle_defects(fixtures::tetrahedron().vertices, topology_in(fixtures::tetrahedron()))) {
    EXPECT_NEAR(defect, std::numbers::pi, 1e-9);
  }
}

TEST(AngleDefects, TubeAndGrid_HaveNone) {
  for (const Mesh& mesh : {fixtures::tube(16, 4), fixtures::grid(5, 4)}) {
    for (const double defect : angle_defects(mesh.vertices, topology_in(mesh))) {
      EXPECT_NEAR(defect, 0, 1e-9);  // at the rim by definition
    }
  }
  const Mesh grid = fixtures::grid(2, 2);
  EXPECT_THROW(angle_defects(grid.vertices.topRows(3), topology_in(grid)), LogicError);
}

TEST(NeighborMeans, ConstantsStay_APeakSpreads) {
  const Mesh mesh = fixtures::grid(4, 4);
  const Topology topology = topology_in(mesh);
  std::vector<double> values(static_cast<std::size_t>(topology.vertex_count), 3);
  EXPECT_EQ(neighbor_means(topology, values, 5), values);
  values.assign(values.size(), 0);
  values[0] = 1;
  EXPECT_EQ(neighbor_means(topology, values, 0), values);
  const std::vector<double> means = neighbor_means(topology, values, 1);
  const Adjacency neighbors = vertex_neighbors(topology);
  for (std::size_t v = 0; v < means.size(); ++v) {
    const auto around = neighbors[static_cast<Index>(v)];
    const bool beside = v == 0 || std::find(around.begin(), around.end(), 0) != around.end();
    EXPECT_NEAR(means[v], beside ? 1.0 / static_cast<double>(around.size() + 1) : 0, 1e-15) << v;
  }
  EXPECT_THROW(neighbor_means(topology, {1, 2}, 1), LogicError);
}

}  // namespace
}  // namespace atelier
