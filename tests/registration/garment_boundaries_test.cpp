#include "registration/template/garment_boundaries.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/template/garment_template.h"
#include "tests/registration/mannequin.h"

namespace atelier::fixtures {
namespace {

using ::testing::UnorderedElementsAre;

std::vector<std::string> names_of(const Mesh& cloth, const std::vector<Capsule>& pose) {
  const Mesh body = body_surface(pose);
  return garment_boundaries(cloth.vertices, cloth.faces, anatomy_of(body), body.vertices,
                            body.faces)
      .names;
}

TEST(GarmentBoundaries, Skirt_HasAWaistAndAHem) {
  EXPECT_THAT(names_of(cone(1.05, 0.17, 0.5, 0.34, 0.03), capsules()),
              UnorderedElementsAre("waist", "hem"));
}

// Hands that hang through the hem made it an opening without a name.
TEST(GarmentBoundaries, Poncho_HasANeckAndAHem) {
  EXPECT_THAT(names_of(cone(1.45, 0.09, 0.9, 0.55, 0.03), capsules(0.3)),
              UnorderedElementsAre("neck", "hem"));
  EXPECT_THAT(names_of(cone(1.45, 0.09, 0.7, 0.55, 0.03), capsules(0.3)),
              UnorderedElementsAre("neck", "hem"));
}

TEST(GarmentBoundaries, RobeOpenInFront_HasAFreeEdge) {
  const std::vector<Capsule> pose = capsules();
  const auto wears_robe = [](const Eigen::Vector3d& middle, int lump) {
    return wears_tee(middle, lump) && (middle.z() < 0 || std::abs(middle.x()) > 0.07);
  };
  GarmentTemplateOptions options;
  options.edge_length = 0.03;
  const GarmentTemplate made = garment_template(
      frames_of({pose}, [=](std::size_t) { return clothed_scan(pose, wears_robe, 0, {}, 0.012); }),
      kClothLabel, "outer", options);
  EXPECT_THAT(made.garment.boundary_names,
              UnorderedElementsAre("free edge", "cuff left", "cuff right"));
  EXPECT_TRUE(made.whole);
}

/// A skirt whose waist is torn down to y = 0.7 at the wearer's left.
Mesh torn_skirt() {
  Mesh skirt = cone(1.05, 0.2, 0.5, 0.34, 0.03);
  std::vector<Index> kept;
  for (Index f = 0; f < skirt.faces.rows(); ++f) {
    const Eigen::RowVector3d corner = skirt.vertices.row(skirt.faces(f, 0));
    if (corner.x() < 0.1 || corner.y() < 0.7) {
      kept.push_back(f);
    }
  }
  skirt.faces = Triangles(skirt.faces(kept, Eigen::all));
  return skirt;
}

// An arm in the gap made "neck" of a skirt's waist.
TEST(GarmentBoundaries, ArmInATornRim_DoesNotRenameIt) {
  const std::vector<Capsule> hanging = capsules(0.05);
  EXPECT_THAT(names_of(torn_skirt(), hanging), UnorderedElementsAre("waist", "hem"));
}

TEST(GarmentBoundaries, LoopThatIsSomethingElseInOnePose_IsWhatItIsInMost) {
  const Mesh skirt = cone(1.05, 0.17, 0.5, 0.34, 0.03);
  const Mesh body = body_surface(capsules());
  const WornPose worn{skirt.vertices, body.vertices};
  WornPose lost = worn;  // beside the body
  lost.vertices.col(0).array() += 3;
  const auto names = [&](const std::vector<WornPose>& poses) {
    return garment_boundaries(skirt.faces, anatomy_of(body), body.faces, poses).names;
  };
  EXPECT_THAT(names({lost, worn, worn}), UnorderedElementsAre("waist", "hem"));
  EXPECT_THAT(names({worn, lost}), UnorderedElementsAre("waist", "hem"));
  EXPECT_THAT(names({lost, lost, worn}), UnorderedElementsAre("opening", "opening 2"));
  EXPECT_THROW(names({}), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
