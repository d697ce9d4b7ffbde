#include "registration/tracking/cut_rim_folds.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "registration/tracking/register_garment.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

TEST(CutRimFolds, FoldsAtTheRim_AreRemovedAndTheRestStays) {
  const Mesh tube = fixtures::cloth_tube(24, 14);
  const Mesh folded = fixtures::with_fold_at_rim(tube);
  ASSERT_FALSE(
      inverted_faces(topology_of(folded.faces, folded.vertices.rows()), folded.vertices).empty());
  const Mesh cut = cut_rim_folds(folded);
  EXPECT_TRUE(is_manifold(manifold_defects(topology_of(cut.faces, cut.vertices.rows()))));
  EXPECT_TRUE(inverted_faces(topology_of(cut.faces, cut.vertices.rows()), cut.vertices).empty());
  EXPECT_EQ(cut.faces.topRows(tube.faces.rows()), tube.faces);
  EXPECT_EQ(cut.vertices.topRows(tube.vertices.rows()), tube.vertices);
}

TEST(CutRimFolds, ThinEars_AreRemoved) {
  Mesh tube = fixtures::cloth_tube(24, 14);
  const Mesh before = tube;
  const std::vector<int> rim =
      boundary_loops(topology_of(tube.faces, tube.vertices.rows())).front();
  const auto tip = static_cast<int>(tube.vertices.rows());
  tube.vertices.conservativeResize(tip + 1, 3);
  tube.vertices.row(tip) = 0.5 * (tube.vertices.row(rim[0]) + tube.vertices.row(rim[1])) +
                           Eigen::RowVector3d(0, -0.001, 0);
  tube.faces.conservativeResize(tube.faces.rows() + 1, 3);
  tube.faces.bottomRows(1) << rim[1], rim[0], tip;
  const Mesh cut = cut_rim_folds(tube);
  EXPECT_EQ(cut.faces, before.faces);
  EXPECT_EQ(cut.vertices, before.vertices);
}

/// The least cosine between neighbouring triangles.
double sharpest_fold(const Mesh& mesh) {
  const Triangles neighbors = face_neighbors(topology_of(mesh.faces, mesh.vertices.rows()));
  const Points normals = face_normals(mesh.vertices, mesh.faces);
  double least = 1;
  for (Index f = 0; f < neighbors.rows(); ++f) {
    for (const int other : neighbors.row(f)) {
      least = other < 0 ? least : std::min(least, normals.row(f).dot(normals.row(other)));
    }
  }
  return least;
}

// None of a flap's triangles is turned against the others.
TEST(CutRimFolds, FlapOfSeveralTriangles_IsRemoved) {
  Mesh sheet = fixtures::grid(8, 8);
  for (const int v : {2, 3, 4, 5, 6}) {
    sheet.vertices.row(v) += Eigen::RowVector3d(0, 0.02, 0.24);
  }
  ASSERT_LT(sharpest_fold(sheet), -0.5);
  const Mesh cut = cut_rim_folds(sheet);
  EXPECT_GE(sharpest_fold(cut), -0.5);
  EXPECT_GE(cut.faces.rows(), sheet.faces.rows() - 16);
  EXPECT_TRUE(is_manifold(manifold_defects(topology_of(cut.faces, cut.vertices.rows()))));
}

TEST(CutRimFolds, CrumplesNextToTheRim_AreRemoved) {
  Mesh sheet = fixtures::grid(8, 8);
  sheet.vertices.row(9 + 4) += Eigen::RowVector3d(0, 0.01, 0.2);  // beyond the row after
  const auto turned = [](const Mesh& mesh) {
    return inverted_faces(topology_of(mesh.faces, mesh.vertices.rows()), mesh.vertices).size();
  };
  ASSERT_GT(turned(sheet), 0U);
  const Mesh cut = cut_rim_folds(sheet);
  EXPECT_EQ(turned(cut), 0U);
  EXPECT_GE(cut.faces.rows(), sheet.faces.rows() - 24);
  EXPECT_TRUE(is_manifold(manifold_defects(topology_of(cut.faces, cut.vertices.rows()))));
}

TEST(CutRimFolds, CleanSurfaces_StayUnchanged) {
  for (const Mesh& mesh :
       {fixtures::cloth_tube(24, 14), fixtures::grid(5, 4), fixtures::sphere(1)}) {
    const Mesh cut = cut_rim_folds(mesh);
    EXPECT_EQ(cut.faces, mesh.faces);
    EXPECT_EQ(cut.vertices, mesh.vertices);
  }
}

// Nothing is left to fold against: one triangle has three edges that are open.
TEST(CutRimFolds, SingleTriangle_StaysUnchanged) {
  Mesh single;
  single.vertices.resize(3, 3);
  single.vertices << 0, 0, 0, 1, 0, 0, 0.5, 1e-6, 0;
  single.faces.resize(1, 3);
  single.faces << 0, 1, 2;
  EXPECT_EQ(cut_rim_folds(single).faces, single.faces);
}

TEST(CutRimFolds, FaceIndexOutOfRange_IsRefused) {
  Mesh tube = fixtures::cloth_tube(6, 2);
  tube.faces(0, 0) = 1000;
  EXPECT_THROW(cut_rim_folds(tube), LogicError);
}

}  // namespace
}  // namespace atelier
