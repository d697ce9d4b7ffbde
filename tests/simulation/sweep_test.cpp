#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "simulation/xpbd/constraint_math.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class Sweep : public fixtures::DeviceTest {};

double rms_angle(const Cloth& cloth, const Points& x) {
  const auto p = [&](int v) { return Vec3d{x(v, 0), x(v, 1), x(v, 2)}; };
  double sum = 0;
  for (const ClothHinge& h : cloth.hinges) {
    const double angle = hinge_value(p(h.edge0), p(h.edge1), p(h.left), p(h.right)).angle;
    sum += angle * angle;
  }
  return std::sqrt(sum / static_cast<double>(cloth.hinges.size()));
}

double mean_strain(const Cloth& cloth, const Points& x) {
  double sum = 0;
  for (int i = 0; i < cloth.fibre_count; ++i) {
    const ClothSpring& s = cloth.springs[i];
    sum += std::abs((x.row(s.a) - x.row(s.b)).norm() / s.rest - 1);
  }
  return sum / cloth.fibre_count;
}

XpbdOptions settling(int substeps) {
  XpbdOptions options;
  options.substeps = substeps;
  options.velocity_damping = 3;
  options.report = false;
  return options;
}

// T18: a curtain, gathered to three quarters of its width at the top.
TEST_P(Sweep, StifferBending_MakesFewerWrinkles) {
  const Mesh flat = fixtures::sheet(24, 16, 0.0125, 'a');
  const Garment garment = fixtures::garment_of(flat, 0.15, 300, 4e-6);
  const std::vector<int> top =
      fixtures::vertices_where(flat.vertices, [](double, double, double z) { return z < 1e-9; });
  const Cloth cloth = make_cloth(garment, top);
  ClothSweep sweep(cloth, {{1, 0.1}, {1, 1}, {1, 10}, {1, 100}}, {}, settling(30), device());
  ClothState start = rest_state(cloth);
  start.positions.col(1) = -flat.vertices.col(2);
  for (Index v = 0; v < start.positions.rows(); ++v) {
    // Gathered into five waves of the right length, more of them than stiff cloth keeps.
    const double s = flat.vertices(v, 0) / 0.3;
    start.positions(v, 0) = 0.75 * flat.vertices(v, 0);
    start.positions(v, 2) = 0.0101 * std::sin(2 * 3.14159265358979323846 * 5 * s);
  }
  Control control;
  for (int scene = 0; scene < sweep.scene_count(); ++scene) {
    sweep.set_state(scene, start);
  }
  for (int i = 0; i < 90; ++i) {
    sweep.advance(control);
  }
  double last = 1e30;
  for (int scene = 0; scene < sweep.scene_count(); ++scene) {
    const double angle = rms_angle(cloth, sweep.state(scene).positions);
    EXPECT_LT(angle, last) << "scene " << scene;
    last = angle;
    RecordProperty("rms_angle_" + std::to_string(scene), std::to_string(angle));
  }
}

// T18: a sheet by two corners; the strain falls with stiffness, as 1 / k where cloth is soft.
TEST_P(Sweep, StifferCloth_StretchesLess) {
  const Mesh flat = fixtures::sheet(12, 12, 0.02, 'e');
  const Garment garment = fixtures::garment_of(flat, 0.15, 8, 1e-6);
  const std::vector<int> top =
      fixtures::vertices_where(flat.vertices, [](double, double, double z) { return z < 1e-9; });
  const Cloth cloth = make_cloth(garment, top);
  ClothSweep sweep(cloth, {{1, 1}, {2, 1}, {4, 1}, {16, 1}, {64, 1}, {128, 1}}, {}, settling(60),
                   device());
  ClothState start = rest_state(cloth);
  start.positions.col(1) = -flat.vertices.col(2);
  start.positions.col(2).setZero();
  for (int scene = 0; scene < sweep.scene_count(); ++scene) {
    sweep.set_state(scene, start);
  }
  // The fixed row stays where the state has it.
  for (int i = 0; i < 120; ++i) {
    sweep.advance({});
  }
  std::vector<double> strain;
  for (int scene = 0; scene < sweep.scene_count(); ++scene) {
    strain.push_back(mean_strain(cloth, sweep.state(scene).positions));
    if (scene > 0) {
      EXPECT_LT(strain[scene], strain[scene - 1]) << "scene " << scene;
    }
    RecordProperty("strain_" + std::to_string(scene), std::to_string(strain[scene]));
  }
  EXPECT_NEAR(strain[0] / strain[1], 2, 0.15);
  EXPECT_NEAR(strain[1] / strain[2], 2, 0.15);
  EXPECT_LT(strain.back(), 0.02 * strain[0]);
}

ATELIER_ON_EVERY_DEVICE(Sweep);

TEST(SweepRefused, NonPositiveFactors_AreRefused) {
  const Cloth cloth = make_cloth(fixtures::garment_of(fixtures::sheet(2, 2, 0.1), 0.2, 100, 1e-5));
  EXPECT_THROW(ClothSweep(cloth, {}, {}, {}), LogicError);
  EXPECT_THROW(ClothSweep(cloth, {{0, 1}}, {}, {}), LogicError);
  EXPECT_THROW(ClothSweep(cloth, {{1, -1}}, {}, {}), LogicError);
  EXPECT_THROW(ClothSweep(cloth, {{1, NAN}}, {}, {}), LogicError);
}

}  // namespace
}  // namespace atelier
