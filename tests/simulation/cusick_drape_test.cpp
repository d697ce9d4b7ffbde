#include "tests/simulation/cusick_drape.h"

#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/material/fabric.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class CusickDrapeTest : public fixtures::DeviceTest {};

// T10: what is published for each kind of fabric.
TEST_P(CusickDrapeTest, Fabrics_DrapeAsPublished) {
  for (const Fabric& fabric : all_fabrics()) {
    if (fabric.drape_high == 100) {
      continue;
    }
    const CusickDrape drape = cusick_drape(fabric.material, {.rings = 15}, device());
    EXPECT_GE(drape.coefficient, fabric.drape_low) << fabric.name;
    EXPECT_LE(drape.coefficient, fabric.drape_high) << fabric.name;
    EXPECT_LT(drape.rest_speed, 0.05) << fabric.name;
    RecordProperty(std::string(fabric.name), std::to_string(drape.coefficient));
  }
}

// T10: monotone in bending, towards a flat board; the same at the same bending length.
TEST_P(CusickDrapeTest, Drape_GrowsWithBendingLengthOnly) {
  Material cloth;
  cloth.density = 0.2;
  cloth.shear = 40;
  double last = 0;
  for (const double bending : {1e-6, 5e-6, 2.5e-5, 1.25e-4, 1e-2}) {
    cloth.bending = bending;
    CusickOptions options;
    options.rings = 12;
    options.substeps = bending > 1e-3 ? 400 : 30;
    options.seconds = bending > 1e-3 ? 0.3 : 2;
    const double coefficient = cusick_drape(cloth, options, device()).coefficient;
    EXPECT_GT(coefficient, last) << "bending " << bending;
    last = coefficient;
  }
  EXPECT_GT(last, 98);

  cloth.bending = 2e-5;
  const double light = cusick_drape(cloth, {.rings = 12}, device()).coefficient;
  cloth.density *= 2;
  cloth.bending *= 2;
  cloth.stretch_warp *= 2;
  cloth.stretch_weft *= 2;
  cloth.shear *= 2;
  EXPECT_NEAR(cusick_drape(cloth, {.rings = 12}, device()).coefficient, light, 0.5);
}

// T9: refining an isotropic mesh changes the drape by less than 5%: from 15 rings to 30 by 2.1 of
// cotton's 68.3 and 0.8 of wool's 52.9, in single precision on the CPU.
TEST_P(CusickDrapeTest, FinerMesh_ChangesTheDrapeLittle) {
  for (const char* name : {"cotton", "wool"}) {
    double least = 100;
    double most = 0;
    for (const int rings : fixtures::soaking() ? std::vector{15, 22, 30} : std::vector{15, 22}) {
      CusickOptions options;
      options.rings = rings;
      options.substeps = 30 * rings * rings / (15 * 15);  // so that none is softer by its solver
      const double coefficient = cusick_drape(fabric_material(name), options, device()).coefficient;
      RecordProperty(std::string(name) + "_" + std::to_string(rings), std::to_string(coefficient));
      least = std::min(least, coefficient);
      most = std::max(most, coefficient);
    }
    EXPECT_LT(most - least, 0.05 * most) << name;
  }
}

ATELIER_ON_EVERY_DEVICE(CusickDrapeTest);

// The same cloth by projective dynamics: in the same bands.
TEST(ProjectiveDrape, Fabrics_DrapeAsPublished) {
  for (const Fabric& fabric : all_fabrics()) {
    if (fabric.drape_high == 100) {
      continue;
    }
    const CusickDrape drape = cusick_drape(
        fabric.material, {.rings = 15, .solver = "projective-friction", .iterations = 10});
    EXPECT_GE(drape.coefficient, fabric.drape_low) << fabric.name;
    EXPECT_LE(drape.coefficient, fabric.drape_high) << fabric.name;
    EXPECT_LT(drape.rest_speed, 0.05) << fabric.name;
    RecordProperty(std::string(fabric.name), std::to_string(drape.coefficient));
  }
}

// XPBD with an iteration a substep drapes softer than its own solution: silk of 2e-6 N m 36.9%, of
// 10 iterations 41.5, of 60 52.8, where projective dynamics has 51.3 of 20 and 51.8 of 60. Solved
// as far, both drape alike.
class ProjectiveDrapeOf : public ::testing::TestWithParam<std::string> {};

TEST_P(ProjectiveDrapeOf, SolvedAsFar_DrapesAsByXpbd) {
  if (!fixtures::soaking()) {
    GTEST_SKIP() << "part of scripts/soak";
  }
  const Material material = fabric_material(GetParam());
  set_thread_count(1);  // of so little cloth, threads would wait for one another
  CusickOptions options{.rings = 15};
  options.iterations = 60;
  const double xpbd = cusick_drape(material, options).coefficient;
  options.solver = "projective-friction";
  options.iterations = 20;
  const double ours = cusick_drape(material, options).coefficient;
  set_thread_count(0);
  EXPECT_NEAR(ours / xpbd, 1, 0.05);
  RecordProperty("coefficients", std::to_string(ours) + " and " + std::to_string(xpbd));
}

INSTANTIATE_TEST_SUITE_P(Soak, ProjectiveDrapeOf,
                         ::testing::Values("silk", "cotton", "wool", "leather", "denim"),
                         [](const auto& of) { return of.param; });

TEST(CusickDrape, DiscAsLargeAsTheSpecimen_IsRefused) {
  EXPECT_THROW(cusick_drape({}, {.specimen_diameter = 0.1, .disc_diameter = 0.1}), LogicError);
  EXPECT_THROW(cusick_drape({}, {.rings = 2}), LogicError);
  Material material;
  material.density = -1;
  EXPECT_THROW(cusick_drape(material), DataError);
}

TEST(Fabric, EveryFabric_IsComplete) {
  EXPECT_EQ(fabric_names().size(), all_fabrics().size() + 1);
  for (const Fabric& fabric : all_fabrics()) {
    const Material m = fabric_material(fabric.name);
    EXPECT_EQ(m.name, fabric.name);
    EXPECT_GT(m.density, 0.02);
    EXPECT_LT(m.density, 1);
    EXPECT_GT(m.bending, 1e-7);
    EXPECT_LT(m.bending, 1e-3);
    EXPECT_GT(m.stretch_warp, m.shear);
    EXPECT_FALSE(fabric.summary.empty());
  }
  EXPECT_THROW(fabric_material("cheese"), LogicError);
}

}  // namespace
}  // namespace atelier
