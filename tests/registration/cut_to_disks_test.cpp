#include "registration/flattening/cut_to_disks.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/flattening/surface_cut.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::no_cut;
using fixtures::opened;
using fixtures::topology;

TEST(CutToDisks, TubesSpheresAndTori_BecomeDisks) {
  for (const Mesh& mesh : {fixtures::tube(12, 5), fixtures::sphere(2), fixtures::torus(16, 8)}) {
    const SurfaceCut cut = cut_surface(topology(mesh), opened(mesh));
    const Topology open = topology_of(cut.faces, static_cast<Index>(cut.source.size()));
    EXPECT_EQ(cut.panel_count, 1);
    EXPECT_EQ(euler_characteristic(open), 1);
    EXPECT_EQ(boundary_loops(open).size(), 1U);
  }
}

TEST(CutToDisks, Tube_IsCutAlongTheShortestPath) {
  const Mesh mesh = fixtures::tube(12, 5, 2);
  const std::vector<char> cut = opened(mesh);
  const std::vector<double> lengths = edge_lengths(topology(mesh), mesh.vertices);
  double length = 0;
  for (std::size_t e = 0; e < cut.size(); ++e) {
    length += cut[e] != 0 ? lengths[e] : 0;
  }
  EXPECT_NEAR(length, 2, 1e-9);
}

TEST(CutToDisks, NegativeCosts_AreRefused) {
  const Mesh mesh = fixtures::tube(12, 5);
  const Topology whole = topology(mesh);
  std::vector<double> costs(static_cast<std::size_t>(whole.edges.rows()), -1);
  EXPECT_THROW(cut_to_disks(whole, no_cut(whole), costs), LogicError);
}

}  // namespace
}  // namespace atelier
