#include "registration/flattening/smooth_surface.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A sheet of 0.3 x 0.3 m in the plane y = 0, with waves of that length (m) and a height of 1 mm.
Mesh wavy_sheet(double wave) {
  Mesh mesh = fixtures::grid(60, 60);
  mesh.vertices *= 0.3 / (mesh.vertices.maxCoeff() - mesh.vertices.minCoeff());
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {  // with a crest in the middle
    const double turn = wave > 0 ? (mesh.vertices(v, 0) - 0.15) / wave : 0.25;
    mesh.vertices(v, 1) = 0.001 * std::cos(2 * std::numbers::pi * turn);
  }
  return mesh;
}

TEST(SmoothedSurface, PlaneWithItsBorder_StaysUnchanged) {
  const Mesh sheet = wavy_sheet(0);
  EXPECT_LT((smoothed_surface(sheet, 0.02) - sheet.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(SmoothedSurface, WaveOfTwoPiReach_KeepsHalfItsHeight) {
  const auto height_in_the_middle = [](double wave, double reach) {
    const Mesh sheet = wavy_sheet(wave);
    const Points smooth = smoothed_surface(sheet, reach);
    double most = 0;
    for (Index v = 0; v < smooth.rows(); ++v) {
      if ((sheet.vertices.row(v) - sheet.vertices.colwise().mean()).norm() < 0.06) {
        most = std::max(most, smooth(v, 1));
      }
    }
    return most;
  };
  constexpr double kReach = 0.008;
  EXPECT_NEAR(height_in_the_middle(2 * std::numbers::pi * kReach, kReach), 0.0005, 5e-5);
  EXPECT_GT(height_in_the_middle(0.2, kReach), 0.00098);
  EXPECT_LT(height_in_the_middle(0.02, kReach), 0.00004);
  EXPECT_EQ(smoothed_surface(wavy_sheet(0.05), 0), wavy_sheet(0.05).vertices);
}

TEST(SmoothedSurface, NegativeReach_IsRefused) {
  EXPECT_THROW(smoothed_surface(wavy_sheet(0), -1), LogicError);
}

}  // namespace
}  // namespace atelier
