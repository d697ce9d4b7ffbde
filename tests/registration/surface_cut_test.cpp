#include "registration/flattening/surface_cut.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::no_cut;
using fixtures::topology;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(CutSurface, NoCuts_KeepTheSurface) {
  const Mesh mesh = fixtures::tube(8, 4);
  const SurfaceCut cut = cut_surface(topology(mesh), no_cut(topology(mesh)));
  EXPECT_EQ(cut.panel_count, 1);
  EXPECT_EQ(static_cast<Index>(cut.source.size()), mesh.vertices.rows());
}

TEST(CutSurface, Labels_SeparatePanels) {
  const Mesh mesh = fixtures::grid(6, 4);
  std::vector<int> labels;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    labels.push_back(mesh.vertices(mesh.faces(f, 0), 0) < 0.49 ? 3 : 8);
  }
  const Topology whole = topology(mesh);
  const SurfaceCut cut = cut_surface(whole, cut_between_labels(whole, labels));
  EXPECT_EQ(cut.panel_count, 2);
  EXPECT_GT(static_cast<Index>(cut.source.size()), mesh.vertices.rows());
}

TEST(CutSurface, NonEdgeCut_IsRefused) {
  const Mesh mesh = fixtures::grid(3, 3);
  try {
    cut_at_edges(topology(mesh), {{0, 15}});
    FAIL() << "not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("ends of an edge"));
  }
  EXPECT_THROW(cut_surface(topology(mesh), {}), LogicError);
  EXPECT_THROW(cut_between_labels(topology(mesh), {1}), LogicError);
}

}  // namespace
}  // namespace atelier
