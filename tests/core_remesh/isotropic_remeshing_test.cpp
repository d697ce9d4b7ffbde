#include "core/remesh/isotropic_remeshing.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/topology.h"

namespace atelier {
namespace {

/// A cone without tip about y, 0.7 m high.
Mesh open_cone() {
  constexpr int kAround = 60;
  constexpr int kRings = 40;
  Mesh mesh;
  mesh.vertices.resize(kAround * kRings, 3);
  mesh.faces.resize(2 * kAround * (kRings - 1), 3);
  Index f = 0;
  for (int r = 0; r < kRings; ++r) {
    const double share = r / (kRings - 1.0);
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      const double radius = 0.1 + 0.1 * share;
      mesh.vertices.row(r * kAround + i) << radius * std::cos(angle), 0.7 * share,
          radius * std::sin(angle);
      if (r + 1 < kRings) {
        const int a = r * kAround + i;
        const int b = r * kAround + (i + 1) % kAround;
        mesh.faces.row(f++) << a, a + kAround, b;
        mesh.faces.row(f++) << b, a + kAround, b + kAround;
      }
    }
  }
  return mesh;
}

std::vector<std::vector<int>> loops_of(const Mesh& mesh) {
  return boundary_loops(topology_of(mesh.faces, mesh.vertices.rows()));
}

TEST(IsotropicRemeshing, GivenLoops_AreClosedReproducibly) {
  const Mesh tube = open_cone();
  const std::vector<std::vector<int>> loops = loops_of(tube);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops_of(isotropic_remeshing(tube, {.edge_length = 0.02, .holes = {}})).size(), 2u);
  const RemeshingOptions closing{.edge_length = 0.02, .holes = {loops[0]}};
  const Mesh closed = isotropic_remeshing(tube, closing);
  EXPECT_EQ(loops_of(closed).size(), 1u);
  EXPECT_EQ(isotropic_remeshing(tube, closing).vertices, closed.vertices);
}

TEST(IsotropicRemeshing, Edges_HaveRequestedLengthOnSurface) {
  // Rims that relax are drawn in, a centimetre here: these stay.
  const Mesh even =
      isotropic_remeshing(open_cone(), {.edge_length = 0.02, .holes = {}, .rims_relax = false});
  Index near = 0;
  for (Index f = 0; f < even.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const double length =
          (even.vertices.row(even.faces(f, k)) - even.vertices.row(even.faces(f, (k + 1) % 3)))
              .norm();
      near += length > 0.8 * 0.02 && length < 4.0 / 3 * 0.02 ? 1 : 0;
    }
  }
  EXPECT_GT(static_cast<double>(near), 0.75 * 3 * static_cast<double>(even.faces.rows()));
  for (Index v = 0; v < even.vertices.rows(); ++v) {
    const Eigen::RowVector3d p = even.vertices.row(v);
    // Chords of the cone and of edges of 2 cm.
    EXPECT_NEAR(std::hypot(p.x(), p.z()), 0.1 + p.y() / 7, 2e-3);
  }
}

TEST(IsotropicRemeshing, SingleTriangle_IsSubdivided) {
  Mesh single;
  single.vertices.resize(3, 3);
  single.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  single.faces.resize(1, 3);
  single.faces << 0, 1, 2;
  EXPECT_GT(isotropic_remeshing(single, {.edge_length = 0.2, .holes = {}}).faces.rows(), 10);
}

TEST(IsotropicRemeshingRefuses, ZeroEdgeLength_Throws) {
  EXPECT_THROW(isotropic_remeshing(open_cone(), {.edge_length = 0, .holes = {}}), LogicError);
}

}  // namespace
}  // namespace atelier
