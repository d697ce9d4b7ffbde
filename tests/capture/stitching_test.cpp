#include "capture/stitching.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

/// Two squares of 40 cm beside each other in a texture of 1 m, sewn at their inner sides: the mesh
/// shares the vertices there, the texture does not.
Mesh two_panels() {
  Mesh mesh;
  mesh.vertices.resize(6, 3);
  mesh.vertices << 0, 0, 0, 0.4, 0, 0, 0.8, 0, 0, 0, 0.4, 0, 0.4, 0.4, 0, 0.8, 0.4, 0;
  mesh.faces.resize(4, 3);
  mesh.faces << 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4;
  mesh.uvs.resize(8, 2);
  mesh.uvs << 0.05, 0.3, 0.45, 0.3, 0.45, 0.7, 0.05, 0.7, 0.50, 0.3, 0.90, 0.3, 0.90, 0.7, 0.50,
      0.7;
  mesh.uv_faces.resize(4, 3);
  mesh.uv_faces << 0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7;
  return mesh;
}

TEST(Stitching, Stitching_DrawsHemsAndSeams) {
  constexpr int kTexels = 1000;  // a texel is a millimetre
  const Image plain(kTexels, kTexels, 3, 0.5F);
  const Image sewn = with_stitching(plain, two_panels(), 1.0);
  const auto at = [&](double u, double v) {
    return sewn.at(static_cast<int>(u * kTexels), static_cast<int>((1 - v) * kTexels), 0);
  };
  EXPECT_FLOAT_EQ(at(0.25, 0.50), 0.5F);           // the middle of a panel is as it was
  EXPECT_FLOAT_EQ(at(0.25, 0.30 + 0.008), 0.45F);  // the fold
  EXPECT_FLOAT_EQ(at(0.25, 0.30 + 0.030), 0.5F);   // above the hem
  EXPECT_LT(at(0.25, 0.3002), 0.3F);               // its edge
  EXPECT_FLOAT_EQ(at(0.44, 0.5), 0.5F);            // no hem where panels are sewn together
  EXPECT_LT(at(0.4497, 0.5), 0.4F);                // but a seam's line, on both sides
  EXPECT_LT(at(0.5003, 0.5), 0.4F);
  EXPECT_FLOAT_EQ(at(0.475, 0.5), 0.5F);  // nothing between panels
  EXPECT_FLOAT_EQ(at(0.25, 0.28), 0.5F);  // nor below the hem
  // Stitches along the hem: dark and light by turns.
  int dark = 0;
  for (int x = 100; x < 400; ++x) {
    dark += sewn.at(x, static_cast<int>((1 - 0.30 - 0.0155) * kTexels), 0) < 0.35F ? 1 : 0;
  }
  EXPECT_GT(dark, 120);
  EXPECT_LT(dark, 250);
}

TEST(Stitching, BadMeshImageOrOptions_AreRefused) {
  const Image plain(16, 16, 3, 0.5F);
  Mesh bare = two_panels();
  bare.uvs.resize(0, 2);
  EXPECT_THROW(with_stitching(plain, bare, 1), LogicError);
  EXPECT_THROW(with_stitching(plain, two_panels(), 0), LogicError);
  EXPECT_THROW(with_stitching(plain, two_panels(), 1, {.hem = 1}), LogicError);
  EXPECT_THROW(with_stitching(plain, two_panels(), 1, {.stitch = 0}), LogicError);
  EXPECT_THROW(with_stitching(Image(16, 16, 1), two_panels(), 1), LogicError);
}

}  // namespace
}  // namespace atelier
