// Patterns of clothes that are worn, whichever way their wearer faces.

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "pipeline/outfit/dressing.h"
#include "registration/flattening/find_pattern.h"
#include "registration/flattening/front_and_back.h"
#include "tests/pipeline/outfit/human_fixture.h"
#include "tests/support/turned.h"

namespace atelier {
namespace {

using fixtures::turned;
using fixtures::woman;

/// A drafted garment as it hangs on the default woman, who looks to +Z.
Mesh worn(const std::string& garment) {
  OutfitOptions options;
  options.garment = garment;
  options.edge_length = 0.03;
  const Outfit outfit = dress_body(woman(), options);
  Mesh mesh = outfit.garments.front().garment.mesh;
  mesh.vertices = outfit.state.positions;
  return mesh;
}

TEST(TurnedGarments, TurnedTee_NeedsTheSameSeams) {
  const Mesh tee = worn("tee");
  ASSERT_EQ(facing_of(tee), Eigen::Vector3d::UnitZ());
  const FoundPattern ahead = find_pattern(tee);
  ASSERT_TRUE(ahead.reached);
  for (const double degrees : {30.0, 90.0, 137.0}) {
    const FoundPattern found = find_pattern(turned(tee, degrees));
    EXPECT_TRUE(found.reached);
    EXPECT_EQ(found.pattern.cut.panel_count, ahead.pattern.cut.panel_count) << degrees;
    EXPECT_NEAR(found.measures.seam_length, ahead.measures.seam_length,
                0.02 * ahead.measures.seam_length)
        << degrees;
  }
}

// Front and back look alike.
TEST(TurnedGarments, GarmentShapes_GiveTheFacingUpToFrontAndBack) {
  for (const char* garment : {"tee", "dress", "trousers", "skirt"}) {
    const Mesh mesh = worn(garment);
    for (int degrees = 0; degrees < 360; degrees += 15) {
      const Eigen::Vector3d facing = facing_of(turned(mesh, degrees));
      const double truly = degrees * std::numbers::pi / 180;
      EXPECT_NEAR(facing.norm(), 1, 1e-9);
      EXPECT_GE(facing.z(), -1e-6);
      EXPECT_GT(std::abs(facing.dot(Eigen::Vector3d(std::sin(truly), 0, std::cos(truly)))),
                std::cos(3 * std::numbers::pi / 180))
          << garment << " turned by " << degrees;
    }
  }
}

}  // namespace
}  // namespace atelier
