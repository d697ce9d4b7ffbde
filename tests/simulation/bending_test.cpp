#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/simulation/cloth_fixtures.h"

namespace atelier {
namespace {

/// Tip drop over length of a clamped strip whose load number w L^3 / B is `gamma`.
double cantilever_drop(double gamma, char kind, int elements, Device device) {
  const double length = 0.1;
  const double size = kind == 'e' ? length / (elements * std::sqrt(3.0) / 2) : length / elements;
  const double density = 0.2;
  const double bending = density * 9.81 * length * length * length / gamma;
  // The strip runs along z; the first two rows are the clamp.
  const double step = kind == 'e' ? size * std::sqrt(3.0) / 2 : size;
  const double stretch = 3e4 * bending / (step * step);
  Garment garment =
      testing::garment_of(testing::sheet(4, elements + 1, size, kind), density, stretch, bending);
  const std::vector<int> clamp = testing::vertices_where(
      garment.mesh.vertices, [&](double, double, double z) { return z < 1.5 * step; });
  XpbdOptions options;
  options.substeps = 60;
  options.iterations = 10;
  options.precision = "double";
  options.report = false;
  options.velocity_damping = 8;
  options.time_step = 1.0 / 60;
  ClothSolver solver(make_cloth(garment, clamp), {}, options, device);
  const ClothState state = testing::settle(solver, {}, 240, 2e-4);
  double drop = 0;
  int count = 0;
  for (Index v = 0; v < state.positions.rows(); ++v) {
    if (garment.mesh.vertices(v, 2) > (elements + 1) * step - 1e-9) {
      drop -= state.positions(v, 1);
      ++count;
    }
  }
  return drop / count / length;
}

// T7: against the exact elastica.
TEST(Cantilever, DISABLED_DroopsAsTheElastica) {
  const struct {
    double gamma, drop;
  } table[] = {{1, 0.12347}, {5, 0.49591}, {10, 0.70020}, {50, 0.90792}};
  for (Device device : testing::devices()) {
    for (const auto& row : table) {
      const double drop = cantilever_drop(row.gamma, 'e', 20, device);
      EXPECT_NEAR(drop / row.drop, 1, 0.02) << "gamma " << row.gamma;
      RecordProperty("gamma_" + std::to_string(int(row.gamma)),
                     std::to_string(drop / row.drop - 1));
    }
  }
}

// T9: the hinge weight makes the drape independent of the mesh size.
TEST(Cantilever, DoesNotChangeWithTheMeshSize) {
  const double coarse = cantilever_drop(10, 'e', 14, Device::Cpu);
  const double fine = cantilever_drop(10, 'e', 28, Device::Cpu);
  EXPECT_NEAR(coarse / fine, 1, 0.05);
}

// T9: a bent template opens, or keeps its shape where rest angles are the template's.
TEST(RestAngles, ACylinderOpensUnlessTheTemplateIsItsRest) {
  Mesh mesh = testing::sheet(3, 16, 0.01);
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
    const Cloth cloth = make_cloth(testing::garment_of(mesh, 0.2, 1000, 1e-4), {}, options);
    XpbdOptions xpbd;
    xpbd.velocity_damping = 5;
    ClothSolver solver(cloth, {}, xpbd);
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

TEST(Garment, ThatCannotBeSimulatedIsRefused) {
  const Garment good = testing::garment_of(testing::sheet(3, 3, 0.05), 0.2, 100, 1e-5);
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
  refused(g, "");
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
