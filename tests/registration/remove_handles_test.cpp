#include "registration/remove_handles.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/remesh/isotropic_remeshing.h"
#include "core/topology.h"
#include "registration/tracking/register_garment.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

/// Of a surface of one piece with its openings closed.
int handles_of(const Mesh& mesh) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  return (2 - static_cast<int>(boundary_loops(topology).size()) - euler_characteristic(topology)) /
         2;
}

/// A tube with a bridge, square and hollow, through its inside: from the square of two triangles at
/// column 0 to the one half way round. Quad q of row r of the tube has triangles 2 q and 2 q + 1.
struct Bridged {
  static constexpr int kAround = 24;
  Mesh tube = fixtures::cloth_tube(kAround, 14);
  Mesh mesh = tube;

  Bridged() {
    const int row = 7 * kAround;
    const std::vector<int> from = boundary_loop_of_two(2 * row, 2 * row + 1);
    const std::vector<int> to =
        boundary_loop_of_two(2 * (row + kAround / 2), 2 * (row + kAround / 2) + 1);
    Triangles faces(mesh.faces.rows() - 4 + 8, 3);
    Index count = 0;
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      const Index quad = f / 2;
      if (quad != row && quad != row + kAround / 2) {
        faces.row(count++) = mesh.faces.row(f);
      }
    }
    // The first of `to` that is nearest to the first of `from` comes opposite to it.
    std::size_t best = 0;
    for (std::size_t k = 1; k < 4; ++k) {
      const auto off = [&](std::size_t at) {
        return (tube.vertices.row(to[at]) - tube.vertices.row(from[0])).norm();
      };
      best = off(k) < off(best) ? k : best;
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const int a = from[k];
      const int b = from[(k + 1) % 4];
      const int c = to[(best + 4 - k) % 4];
      const int d = to[(best + 7 - k) % 4];
      faces.row(count++) << a, b, c;
      faces.row(count++) << b, d, c;
    }
    mesh.faces = faces;
  }

  /// The four corners of two triangles, in the direction of their edges.
  std::vector<int> boundary_loop_of_two(int first, int second) const {
    std::vector<int> ring;
    for (int k = 0; k < 3; ++k) {
      const int a = tube.faces(first, k);
      const int b = tube.faces(first, (k + 1) % 3);
      ring.push_back(a);
      for (int j = 0; j < 3; ++j) {
        if (tube.faces(second, j) == b && tube.faces(second, (j + 1) % 3) == a) {
          ring.push_back(tube.faces(second, (j + 2) % 3));
        }
      }
    }
    return ring;
  }
};

TEST(RemoveHandles, SurfaceWithoutHandles_StaysUnchanged) {
  Mesh thin = fixtures::cloth_tube(12, 10);
  thin.vertices.col(0) *= 0.1;  // 9 cm round: a loop that parts the tube
  thin.vertices.col(2) *= 0.1;
  for (const Mesh& mesh : {thin, fixtures::sphere(3)}) {
    const CutHandles same = remove_handles(mesh, 1);
    EXPECT_EQ(same.cut, 0);
    EXPECT_EQ(same.mesh.vertices, mesh.vertices);
    EXPECT_EQ(same.mesh.faces, mesh.faces);
  }
}

TEST(RemoveHandles, Bridge_IsCutAcross) {
  const Bridged bridged;
  ASSERT_TRUE(
      is_manifold(manifold_defects(topology_of(bridged.mesh.faces, bridged.mesh.vertices.rows()))));
  ASSERT_EQ(handles_of(bridged.mesh), 1);
  const CutHandles open = remove_handles(bridged.mesh, 0.4);
  EXPECT_EQ(open.cut, 1);
  EXPECT_EQ(open.mesh.faces.rows(), bridged.mesh.faces.rows());
  const Topology topology = topology_of(open.mesh.faces, open.mesh.vertices.rows());
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  EXPECT_EQ(connected_components(topology).count, 1);
  EXPECT_EQ(boundary_loops(topology).size(), 4U);
  EXPECT_EQ(handles_of(open.mesh), 0);
  // The two sides of the cut lie on each other.
  const Index before = bridged.mesh.vertices.rows();
  const Index doubled = open.mesh.vertices.rows() - before;
  EXPECT_EQ(doubled, 4);
  for (Index v = 0; v < doubled; ++v) {
    EXPECT_EQ((bridged.mesh.vertices.rowwise() - open.mesh.vertices.row(before + v))
                  .rowwise()
                  .norm()
                  .minCoeff(),
              0);
  }
}

TEST(RemoveHandles, LongerLoops_AreKept) {
  const Bridged bridged;
  EXPECT_EQ(remove_handles(bridged.mesh, 0.05).cut, 0);
  EXPECT_EQ(remove_handles(bridged.mesh, 0).cut, 0);
}

// Round a torus of 0.1 and 0.03 m the shortest loop goes the short way, 0.19 m.
TEST(RemoveHandles, Torus_IsCutTheShortWay) {
  Mesh torus = fixtures::torus(40, 16, 0.3);
  torus.vertices *= 0.1;
  EXPECT_EQ(remove_handles(torus, 0.18).cut, 0);
  const CutHandles open = remove_handles(torus, 0.2);
  EXPECT_EQ(open.cut, 1);
  EXPECT_EQ(open.mesh.vertices.rows(), torus.vertices.rows() + 16);
  EXPECT_EQ(handles_of(open.mesh), 0);
  // Closed over both sides there is nothing that isotropic triangles do not fit.
  const Topology topology = topology_of(open.mesh.faces, open.mesh.vertices.rows());
  const Mesh even =
      isotropic_remeshing(open.mesh, {.edge_length = 0.015, .holes = boundary_loops(topology)});
  EXPECT_EQ(euler_characteristic(topology_of(even.faces, even.vertices.rows())), 2);
}

TEST(RemoveHandlesRefused, BranchingOrUnorientedSurfaces_AreRefused) {
  Mesh mesh = fixtures::tetrahedron();
  mesh.faces.row(3).reverseInPlace();
  ATELIER_EXPECT_REFUSED(remove_handles(mesh, 1), LogicError, "oriented");
  mesh = fixtures::tetrahedron();
  mesh.vertices.conservativeResize(5, 3);
  mesh.vertices.row(4) << 0, 0, 3;
  mesh.faces.conservativeResize(5, 3);
  mesh.faces.row(4) << 0, 1, 4;
  ATELIER_EXPECT_REFUSED(remove_handles(mesh, 1), LogicError, "oriented");
}

}  // namespace
}  // namespace atelier
