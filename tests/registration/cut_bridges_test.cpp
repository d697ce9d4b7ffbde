#include "registration/cut_bridges.h"

#include <Eigen/Geometry>
#include <numbers>

#include <gtest/gtest.h>

#include "core/topology.h"
#include "registration/loose_vertices.h"
#include "tests/registration/mannequin.h"

namespace atelier {
namespace {

/// A ring, its tube of 4 cm round a circle of 16 cm, with one opening.
Mesh open_ring() {
  constexpr int kAround = 48;
  constexpr int kAcross = 14;
  Mesh ring;
  ring.vertices.resize(kAround * kAcross, 3);
  ring.faces.resize(2 * kAround * kAcross - 8, 3);
  Index f = 0;
  for (int i = 0; i < kAround; ++i) {
    for (int k = 0; k < kAcross; ++k) {
      const double u = 2 * std::numbers::pi * i / kAround;
      const double v = 2 * std::numbers::pi * k / kAcross;
      const double r = 0.16 + 0.04 * std::cos(v);
      ring.vertices.row(i * kAcross + k) << r * std::cos(u), 0.04 * std::sin(v), -r * std::sin(u);
      if (i < 2 && k < 2) {
        continue;  // the opening
      }
      const auto at = [](int row, int column) {
        return (row % kAround) * kAcross + column % kAcross;
      };
      ring.faces.row(f++) << at(i, k), at(i + 1, k), at(i + 1, k + 1);
      ring.faces.row(f++) << at(i, k), at(i + 1, k + 1), at(i, k + 1);
    }
  }
  return without_loose_vertices(ring);
}

int handles(const Mesh& mesh) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  return (2 - static_cast<int>(boundary_loops(topology).size()) - euler_characteristic(topology)) /
         2;
}

TEST(CutBridges, CutsAcrossARingsTubeAndNotThroughItsEye) {
  const Mesh ring = open_ring();
  ASSERT_EQ(handles(ring), 1);
  const CutBridges cut = cut_bridges(ring);
  EXPECT_EQ(cut.count, 1);
  EXPECT_EQ(handles(cut.mesh), 0);
  const Topology topology = topology_of(cut.mesh.faces, cut.mesh.vertices.rows());
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  EXPECT_EQ(connected_components(topology).count, 1);
  EXPECT_EQ(boundary_loops(topology).size(), 3U) << "its opening, and a rim on either side";
  EXPECT_GT(cut.mesh.vertices.rows(), ring.vertices.rows() - 60) << "a slice of it is gone";
}

TEST(CutBridges, LeavesWhatHasNoHandleAndWhatIsTooThick) {
  const Mesh ring = open_ring();
  const Mesh tube = cut_bridges(ring).mesh;
  const CutBridges again = cut_bridges(tube);
  EXPECT_EQ(again.count, 0);
  EXPECT_EQ(again.mesh.faces, tube.faces);
  const CutBridges thick = cut_bridges(ring, 0.2);
  EXPECT_EQ(thick.count, 0);
  EXPECT_EQ(thick.mesh.faces, ring.faces);
}

/// Arms that hang straight, sleeves `gap` metres from the trunk's cloth.
std::vector<fixtures::Capsule> hanging_arms(double gap) {
  using namespace fixtures;
  std::vector<Capsule> all = capsules(0);
  const double out = 0.14 + kGap + gap + kGap + 0.045;
  for (Capsule& limb : all) {
    if (limb.lump >= kLeftUpperArm && limb.lump <= kRightHand) {
      const double side = limb.lump <= kLeftHand ? 1 : -1;
      limb.from.x() += side * (out - 0.16);
      limb.to.x() += side * (out - 0.16);
    }
  }
  for (const int side : {1, -1}) {
    const int arm = side > 0 ? kLeftUpperArm : kRightUpperArm;
    all.push_back({{side * 0.05, 1.40, 0}, {side * out, 1.38, 0}, 0.045, arm});
  }
  return all;
}

TEST(CutBridges, OfATemplateWhoseSleevesHangHalfACentimetreFromTheTrunk) {
  using namespace fixtures;
  const std::vector<Capsule> all = hanging_arms(0.005);
  const GarmentTemplate made = garment_template(
      frames_of({all}, [&](std::size_t) { return clothed_scan(all, wears_tee, 0.001); }),
      kClothLabel, "tee");
  EXPECT_GT(made.bridges_cut, 0);
  EXPECT_EQ(handles(made.garment.mesh), 0);
  EXPECT_EQ(made.garment.boundary_names.size(), 4U);
}

}  // namespace
}  // namespace atelier
