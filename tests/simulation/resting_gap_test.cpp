#include "simulation/contact/resting_gap.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A ball of 0.3 m and cloth round it, `gap` off where it looks up and 15 mm off elsewhere.
struct Worn {
  Mesh body = fixtures::sphere(4);
  Points cloth;
};

Worn worn(double gap) {
  Worn scene;
  scene.body.vertices *= 0.3;
  scene.cloth = scene.body.vertices;
  for (Index v = 0; v < scene.cloth.rows(); ++v) {
    const Eigen::RowVector3d out = scene.cloth.row(v).normalized();
    scene.cloth.row(v) += (out.y() > 0.6 ? gap : 0.015) * out;
  }
  return scene;
}

TEST(RestingGap, UpwardFacingCloth_GivesTheGap) {
  for (const double gap : {0.002, 0.006, 0.012}) {
    const Worn scene = worn(gap);
    EXPECT_NEAR(resting_gap(scene.cloth, scene.body.vertices, scene.body.faces, 0.004), gap, 2e-4);
  }
}

TEST(RestingGap, ClothSpanningAHollow_DoesNotCount) {
  Worn scene = worn(0.006);
  for (Index v = 0; v < scene.cloth.rows(); v += 2) {  // every other place is off the body
    scene.cloth.row(v) += 0.005 * scene.cloth.row(v).normalized();
  }
  EXPECT_NEAR(resting_gap(scene.cloth, scene.body.vertices, scene.body.faces, 0.004), 0.006, 2e-4);
}

TEST(RestingGap, ClothInsideTheBody_HasANegativeGap) {
  const Worn scene = worn(-0.003);
  EXPECT_NEAR(resting_gap(scene.cloth, scene.body.vertices, scene.body.faces, 0.004), -0.003, 2e-4);
}

TEST(RestingGap, ClothRestingNowhere_GivesTheDefaultGap) {
  Worn scene = worn(0.006);
  scene.cloth.rowwise() += Eigen::RowVector3d(0, -0.1, 0);  // hangs below
  const Points below = scene.cloth.bottomRows(10);
  EXPECT_EQ(resting_gap(below.rowwise() + Eigen::RowVector3d(0, -1, 0), scene.body.vertices,
                        scene.body.faces, 0.004),
            0.004);
  EXPECT_EQ(resting_gap(Points(0, 3), scene.body.vertices, scene.body.faces, 0.004), 0.004);
}

}  // namespace
}  // namespace atelier
