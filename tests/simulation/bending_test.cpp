#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class RestAngles : public fixtures::DeviceTest {};

// T9: a bent template opens, or keeps its shape where rest angles are the template's.
TEST_P(RestAngles, RolledCylinder_OpensUnlessTemplateIsRest) {
  Mesh mesh = fixtures::sheet(3, 16, 0.01);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double a = mesh.vertices(v, 2) / 0.04;
    mesh.vertices(v, 1) = 0.04 * std::sin(a);
    mesh.vertices(v, 2) = 0.04 * std::cos(a);
  }
  const auto span = [](const Points& x) { return (x.row(0) - x.row(x.rows() - 1)).norm(); };
  Control control;
  control.gravity.setZero();
  for (const char* rest : {"flat", "template"}) {
    ClothOptions options;
    options.rest_angles = rest;
    const Cloth cloth = make_cloth(fixtures::garment_of(mesh, 0.2, 1000, 1e-4), {}, options);
    XpbdOptions xpbd;
    xpbd.velocity_damping = 5;
    ClothSolver solver(cloth, {}, xpbd, device());
    const double before = span(cloth.rest_positions);
    for (int i = 0; i < 90; ++i) {
      solver.advance(control);
    }
    const double after = span(solver.state().positions);
    if (rest[0] == 'f') {
      EXPECT_GT(after, 0.15);
    } else {
      EXPECT_NEAR(after, before, 1e-4);
    }
  }
}

ATELIER_ON_EVERY_DEVICE(RestAngles);

TEST(Garment, UnsimulatableGarment_IsRefused) {
  const Garment good = fixtures::garment_of(fixtures::sheet(3, 3, 0.05), 0.2, 100, 1e-5);
  const auto refused = [](const Garment& garment, const std::string& words) {
    try {
      make_cloth(garment);
      ADD_FAILURE() << "accepted: " << words;
    } catch (const DataError& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  Garment g = good;
  g.mesh.vertices.row(5) = g.mesh.vertices.row(6);
  refused(g, "degenerate");
  g = good;
  g.mesh.faces.conservativeResize(g.mesh.faces.rows() + 1, 3);
  g.mesh.faces.row(g.mesh.faces.rows() - 1) << 5, 6, 1;
  refused(g, "manifold");
  g = good;
  g.mesh.faces.row(0).reverseInPlace();
  refused(g, "opposite orientation");
  g = good;
  g.material.density = 0;
  refused(g, "density");
  g = good;
  g.material.stretch_warp = -1;
  refused(g, "stretch_warp");
  g = good;
  g.material.bending = NAN;
  refused(g, "bending");
  g = good;
  g.mesh.vertices.conservativeResize(g.mesh.vertices.rows() + 1, 3);
  g.mesh.vertices.row(g.mesh.vertices.rows() - 1).setConstant(1);
  refused(g, "no mass");
  g = good;
  g.mesh.faces.resize(0, 3);
  refused(g, "none");
  EXPECT_THROW(make_cloth(good, {16}), LogicError);
  EXPECT_THROW(make_cloth(good, {-1}), LogicError);
  ClothOptions options;
  options.membrane = "strain";
  EXPECT_THROW(make_cloth(good, {}, options), DataError);
  options.membrane = "cheese";
  EXPECT_THROW(make_cloth(good, {}, options), DataError);
}

}  // namespace
}  // namespace atelier
