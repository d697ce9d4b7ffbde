#include "simulation/cloth/weld_seams.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/topology.h"
#include "simulation/cloth/cloth.h"

namespace atelier {
namespace {

// Two squares of two triangles, sewn along one side.
Garment two_squares() {
  Garment garment;
  garment.mesh.vertices.resize(8, 3);
  garment.mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,  //
      1.2, 0, 0, 2, 0, 0, 2, 1, 0, 1.2, 1, 0;
  garment.mesh.faces.resize(4, 3);
  garment.mesh.faces << 0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7;
  garment.rest.resize(8, 2);
  garment.rest << 0, 0, 1, 0, 1, 1, 0, 1, 3, 0, 4, 0, 4, 1, 3, 1;
  garment.rest_faces = garment.mesh.faces;
  garment.seams = {{"side", {1, 2}, {4, 7}}};
  garment.boundaries = {{0, 1, 4, 5, 6, 7, 2, 3}};
  garment.boundary_names = {"edge"};
  garment.attachments = {{1, 0, {1, 0, 0}, 0}, {4, 1, {1, 0, 0}, 0}};
  return garment;
}

TEST(WeldSeams, SeamPairs_AreJoinedAtTheirMeanKeepingFlatPanels) {
  const Garment sewn = weld_seams(two_squares());
  EXPECT_EQ(sewn.mesh.vertices.rows(), 6);
  EXPECT_EQ(sewn.rest.rows(), 8);
  EXPECT_DOUBLE_EQ(sewn.mesh.vertices(sewn.mesh.faces(0, 1), 0), 1.1);
  EXPECT_EQ(sewn.mesh.faces(0, 1), sewn.mesh.faces(2, 0));
  EXPECT_TRUE(sewn.seams.empty());
  EXPECT_EQ(sewn.boundaries[0].size(), 6U);
  EXPECT_EQ(sewn.attachments.size(), 1U);
  EXPECT_NO_THROW(check_garment(sewn));
  EXPECT_EQ(connected_components(topology_of(sewn.mesh.faces, sewn.mesh.vertices.rows())).count, 1);
}

TEST(WeldSeams, SewnHinges_BendAcrossTheSeamWithFlatRestLengths) {
  const Cloth apart = make_cloth(two_squares());
  const Cloth sewn = make_cloth(weld_seams(two_squares()));
  EXPECT_EQ(apart.hinges.size(), 2U);
  EXPECT_EQ(sewn.hinges.size(), 3U);
  for (const ClothSpring& spring : sewn.springs) {
    EXPECT_TRUE(std::abs(spring.rest - 1) < 1e-9 || std::abs(spring.rest - std::sqrt(2)) < 1e-9)
        << spring.rest;
  }
}

TEST(WeldSeams, GarmentWithoutSeams_StaysUnchanged) {
  Garment garment = two_squares();
  garment.seams.clear();
  EXPECT_EQ(weld_seams(garment).mesh.faces, garment.mesh.faces);
}

TEST(WeldSeamsRefused, CollapsingOrDanglingSeams_AreRefused) {
  Garment garment = two_squares();
  garment.seams = {{"dart", {0}, {1}}};
  try {
    weld_seams(garment);
    FAIL();
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find("joins two of its corners"), std::string::npos);
  }
  garment.seams = {{"side", {0}, {99}}};
  EXPECT_THROW(weld_seams(garment), DataError);
}

}  // namespace
}  // namespace atelier
