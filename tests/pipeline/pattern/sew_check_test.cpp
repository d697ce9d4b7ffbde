// A written pattern sewn anew: that it comes back to the garment it was taken from, and that a
// pattern of another garment does not.

#include "pipeline/pattern/sew_check.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/topology.h"
#include "registration/drafting/draft_pattern.h"
#include "registration/drafting/garment_pattern_text.h"
#include "registration/drafting/name_pattern.h"
#include "registration/drafting/panels_on_surface.h"
#include "registration/sewing/garment_pattern_json.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

Mesh scaled(Mesh mesh, double radius, double low) {
  mesh.vertices.col(0) *= radius;
  mesh.vertices.col(2) *= radius;
  mesh.vertices.col(1).array() += low;
  return mesh;
}

/// A closed trunk round which a skirt hangs, and above its waist as much again.
Mesh trunk() {
  constexpr int kAround = 32;
  Mesh body = scaled(fixtures::tube(kAround, 30, 2), 0.18, -0.7);
  const auto ends = static_cast<int>(body.vertices.rows());
  const int top = ends - kAround;
  body.vertices.conservativeResize(ends + 2, 3);
  body.vertices.row(ends) << 0, -0.7, 0;
  body.vertices.row(ends + 1) << 0, 1.3, 0;
  const Index sides = body.faces.rows();
  body.faces.conservativeResize(sides + 2 * kAround, 3);
  for (int i = 0; i < kAround; ++i) {
    const int next = (i + 1) % kAround;
    body.faces.row(sides + i) << next, i, ends;
    body.faces.row(sides + kAround + i) << top + i, top + next, ends + 1;
  }
  return body;
}

/// A straight skirt in front and back, drawn and written.
struct WrittenSkirt {
  Mesh mesh = scaled(fixtures::tube(48, 12, 0.5), 0.2, 0);
  FlatPattern flat;
  PatternNames names;
  SewingPattern draft;
  std::string text;
  double front_from = 0;  // m ahead

  WrittenSkirt() { draw(); }

  /// Its hem rises to the left, and it is worn behind the origin.
  static WrittenSkirt slanted_elsewhere() {
    WrittenSkirt skirt;
    for (Index v = 0; v < skirt.mesh.vertices.rows(); ++v) {
      const double down = 1 - skirt.mesh.vertices(v, 1) / 0.5;
      skirt.mesh.vertices(v, 1) += 0.4 * down * (skirt.mesh.vertices(v, 0) + 0.2);
    }
    skirt.mesh.vertices.col(2).array() -= 1;
    skirt.front_from = -1.12;
    skirt.draw();
    return skirt;
  }

  void draw() {
    const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
    std::vector<int> labels;
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      double ahead = 0;
      for (int k = 0; k < 3; ++k) {
        ahead += mesh.vertices(mesh.faces(f, k), 2);
      }
      labels.push_back(ahead > 3 * front_from ? 1 : 0);
    }
    flat = flatten_surface(mesh, cut_between_labels(topology, labels));
    names = name_pattern(flat, mesh, Eigen::Vector3d::UnitZ());
    draft = draft_pattern(flat, names);
    place_on_surface(draft, mesh, flat);
    draft = in_craft_order(draft);
    text = garment_pattern_text(draft);
  }

  SewnPattern sewn(const std::string& written) const {
    SewCheckOptions options;
    options.edge_length = 0.03;
    options.seconds = 0.5;
    return *sew_anew({written, names.panels, flat, mesh, mesh}, {mesh, trunk()}, options,
                     [] { return false; });
  }
};

TEST(SewAnew, WrittenSkirt_HangsWhereItWasCaptured) {
  const WrittenSkirt skirt;
  const SewnPattern sewn = skirt.sewn(skirt.text);
  EXPECT_LT(sewn.mean, 0.005);
  EXPECT_LT(sewn.p95, 0.012);
  EXPECT_GT(sewn.p95, sewn.mean);
  EXPECT_EQ(sewn.off.size(), sewn.mesh.vertices.rows());
  const Topology topology = topology_of(sewn.mesh.faces, sewn.mesh.vertices.rows());
  EXPECT_EQ(boundary_loops(topology).size(), 2U) << "waist and hem: its seams are closed";
}

TEST(SewAnew, WearerWhoTurned_IsSeenFromTheFront) {
  const WrittenSkirt skirt;
  const Eigen::Matrix3d half = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()).matrix();
  WornGarment worn{skirt.mesh, trunk()};
  worn.cloth.vertices *= half.transpose();
  worn.body.vertices *= half.transpose();
  SewCheckOptions options;
  options.edge_length = 0.03;
  options.seconds = 0.05;
  const SewnPattern sewn =
      *sew_anew({skirt.text, skirt.names.panels, skirt.flat, skirt.mesh, skirt.mesh}, worn, options,
                [] { return false; });
  EXPECT_LT((sewn.turn - half).norm(), 1e-9);
}

TEST(SewAnew, PatternOfAShorterSkirt_IsFarther) {
  const WrittenSkirt skirt;
  SewingPattern shorter = skirt.draft;
  for (Panel& panel : shorter.panels) {
    panel.corners.col(1) *= 0.8;  // its edges are lines
  }
  const SewnPattern sewn = skirt.sewn(garment_pattern_text(shorter));
  EXPECT_GT(sewn.p95, 0.03);
  EXPECT_GT(sewn.mean, 2 * skirt.sewn(skirt.text).mean);
}

TEST(SewAnew, EdgesSewnToOthers_AreRefused) {
  const WrittenSkirt skirt;
  SewingPattern crossed = skirt.draft;
  ASSERT_EQ(crossed.seams.size(), 2U);
  SewnEdges& left = crossed.seams[0];
  SewnEdges& right = crossed.seams[1];
  std::swap(left.edge_b, right.panel_b == left.panel_b ? right.edge_b : right.edge_a);
  try {
    skirt.sewn(garment_pattern_text(crossed));
    ADD_FAILURE() << "sides of the skirt that lie across it from each other";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("mm apart on the captured garment"));
  }
}

TEST(SewAnew, OtherTrianglesOrPanels_AreRefused) {
  const WrittenSkirt skirt;
  WornGarment worn{skirt.mesh, trunk()};
  worn.cloth.faces.conservativeResize(worn.cloth.faces.rows() - 1, 3);
  const auto going_on = [] { return false; };
  EXPECT_THROW(sew_anew({skirt.text, skirt.names.panels, skirt.flat, skirt.mesh, skirt.mesh}, worn,
                        {}, going_on),
               DataError);
  const std::vector<std::string> others = {"left", "right"};
  EXPECT_THROW(sew_anew({skirt.text, others, skirt.flat, skirt.mesh, skirt.mesh},
                        {skirt.mesh, trunk()}, {}, going_on),
               DataError);
}

TEST(SewAnew, Stopped_GivesNothing) {
  const WrittenSkirt skirt;
  EXPECT_FALSE(sew_anew({skirt.text, skirt.names.panels, skirt.flat, skirt.mesh, skirt.mesh},
                        {skirt.mesh, trunk()}, {}, [] { return true; }));
}

TEST(PanelsOnSurface, Panels_LieOnTheSurfaceWithSeamsThatMeet) {
  const WrittenSkirt skirt;
  const Garment panels = panels_on_surface(skirt.draft, skirt.names.panels, skirt.flat,
                                           skirt.mesh.vertices, {.edge_length = 0.03});
  for (Index v = 0; v < panels.mesh.vertices.rows(); ++v) {
    EXPECT_NEAR(std::hypot(panels.mesh.vertices(v, 0), panels.mesh.vertices(v, 2)), 0.2, 1e-3);
  }
  for (const Seam& seam : panels.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      EXPECT_LT((panels.mesh.vertices.row(seam.a[i]) - panels.mesh.vertices.row(seam.b[i])).norm(),
                5e-3);
    }
  }
}

TEST(PanelsOnSurface, SlantedSkirtOfAWearerElsewhere_LiesWhereItWas) {
  const WrittenSkirt skirt = WrittenSkirt::slanted_elsewhere();
  const Garment panels =
      panels_on_surface(garment_pattern_from_json(skirt.text, "pattern.json"), skirt.names.panels,
                        skirt.flat, skirt.mesh.vertices, {.edge_length = 0.03});
  ASSERT_EQ(panels.seams.size(), 2U);
  for (const Seam& seam : panels.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      EXPECT_LT((panels.mesh.vertices.row(seam.a[i]) - panels.mesh.vertices.row(seam.b[i])).norm(),
                0.01);
    }
  }
}

TEST(WornGarment, WrittenFolder_IsReadAgain) {
  const fixtures::TemporaryDirectory root;
  const WrittenSkirt skirt;
  EXPECT_EQ(worn_folder(root.path(), "skirt.obj"), "");
  write_worn(root.path() / "captured" / "skirt", {skirt.mesh, trunk(), 1.5}, 7);
  const std::filesystem::path folder = worn_folder(root.path(), "anywhere/skirt.obj");
  ASSERT_EQ(folder, root.path() / "captured" / "skirt");
  const WornGarment worn = read_worn(folder);
  EXPECT_EQ(worn.cloth.vertices, skirt.mesh.vertices);
  EXPECT_EQ(worn.body.faces, trunk().faces);
  EXPECT_EQ(worn.acceleration, 1.5);
}

}  // namespace
}  // namespace atelier
