#include "simulation/material/membrane_in_use.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::HasSubstr;

/// Two right-angled triangles of 1 m, of a cloth four times as stiff along the grain.
Garment square(bool flat) {
  Garment garment;
  garment.mesh.vertices.resize(4, 3);
  garment.mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  garment.mesh.faces.resize(2, 3);
  garment.mesh.faces << 0, 1, 2, 0, 2, 3;
  if (flat) {
    garment.rest = garment.mesh.vertices.leftCols(2);
    garment.rest_faces = garment.mesh.faces;
  }
  garment.material.stretch_warp = 1060;
  garment.material.stretch_weft = 232;
  garment.material.shear = 55;
  return garment;
}

/// Of the spring along x, across the grain: one triangle of 0.5 m2 at an edge of 1 m.
double modulus_solved(const Garment& garment) {
  for (const ClothSpring& spring : make_cloth(garment).springs) {
    if (spring.a + spring.b == 1) {
      return spring.stiffness / 0.5;
    }
  }
  return 0;
}

TEST(MembraneInUse, Springs_GiveTheReportedModulus) {
  const MembraneInUse mean = membrane_in_use(square(false), {});
  EXPECT_DOUBLE_EQ(mean.warp, 646);
  EXPECT_DOUBLE_EQ(mean.weft, modulus_solved(square(false)));
  EXPECT_EQ(text_of(mean),
            "Young's modulus 646 N/m (mean of warp and weft: no flat rest shape), Poisson's ratio "
            "1/3, bending 1e-05 N m");
  const MembraneInUse apart = membrane_in_use(square(true), {});
  EXPECT_DOUBLE_EQ(apart.weft, modulus_solved(square(true)));
  EXPECT_EQ(modulus_text(apart, 10), "1.06e+04/2320");
  EXPECT_THAT(text_of(apart), HasSubstr("1060 N/m (warp), 232 N/m (weft), Poisson's ratio 1/3, b"));
}

TEST(MembraneInUse, SeparateShear_IsReported) {
  ClothOptions strain;
  strain.membrane = "strain";
  EXPECT_THAT(text_of(membrane_in_use(square(true), strain)),
              HasSubstr("Poisson's ratio 0, shear 55 N/m"));
  ClothOptions cross;
  cross.shear = "cross";
  EXPECT_THAT(text_of(membrane_in_use(square(true), cross)),
              HasSubstr("Poisson's ratio by the shear springs, shear 55 N/m"));
}

}  // namespace
}  // namespace atelier
