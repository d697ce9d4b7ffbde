#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/test_bodies.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class CrossShear : public fixtures::DeviceTest {};
class HingeWeight : public fixtures::DeviceTest {};

/// What a cloth holds of energy when every vertex is held where `deformed` puts it [J].
template <class Deformed>
double held_energy(const Garment& garment, const ClothOptions& options, Device device,
                   const Deformed& deformed) {
  std::vector<int> all;
  for (int v = 0; v < garment.mesh.vertices.rows(); ++v) {
    all.push_back(v);
  }
  const Cloth cloth = make_cloth(garment, all, options);
  XpbdOptions xpbd;
  xpbd.precision = "double";
  ClothSolver solver(cloth, {}, xpbd, device);
  Control control;
  control.pin_targets = cloth.rest_positions;
  for (Index v = 0; v < control.pin_targets.rows(); ++v) {
    control.pin_targets.row(v) = deformed(Eigen::RowVector3d(control.pin_targets.row(v)));
  }
  return solver.advance(control).elastic_energy;
}

// Springs of modulus Y on equilateral triangles are a plate of Poisson's ratio 1/3: 9/8 Y against
// being stretched one way, 3/8 Y against being sheared. Those across inner edges add `shear` to Y.
TEST_P(CrossShear, CrossSprings_AddTheirModulus) {
  constexpr int kCells = 24;
  constexpr double kSize = 0.01;
  constexpr double kStrain = 1e-4;
  Garment garment = fixtures::garment_of(fixtures::sheet(kCells, kCells, kSize, 'e'), 0.2, 400, 0);
  garment.material.shear = 100;
  ClothOptions cross;
  cross.shear = "cross";
  const Cloth cloth = make_cloth(garment, {}, cross);
  // Two triangles an inner edge; at the border there is nothing to be across of.
  const double pair = std::sqrt(3.0) / 2 * kSize * kSize;
  const double area = pair / 3 * (cloth.sewing_begin - cloth.fibre_count);
  EXPECT_GT(area, 0.9 * kCells * kSize * kCells * std::sqrt(3.0) / 2 * kSize);
  const auto added = [&](const auto& deformed) {
    return held_energy(garment, cross, device(), deformed) -
           held_energy(garment, {}, device(), deformed);
  };
  const double pulled = added([&](Eigen::RowVector3d p) {
    p.x() *= 1 + kStrain;
    return p;
  });
  const double sheared = added([&](Eigen::RowVector3d p) {
    p.x() += kStrain * p.z();
    return p;
  });
  EXPECT_NEAR(pulled / (0.5 * 9 / 8.0 * 100 * kStrain * kStrain * area), 1, 0.05);
  EXPECT_NEAR(sheared / (0.5 * 3 / 8.0 * 100 * kStrain * kStrain * area), 1, 0.05);
}

/// A sheet with two slivers on both sides of one edge.
Garment with_slivers() {
  Garment garment = fixtures::garment_of(fixtures::sheet(6, 6, 0.02), 0.2, 300, 1e-5);
  // The middle of the sheet and its neighbour below lie close to the diagonal between them.
  const int middle = 3 * 7 + 3;
  garment.mesh.vertices.row(middle + 1) =
      0.5 * (garment.mesh.vertices.row(middle) + garment.mesh.vertices.row(middle + 8)) +
      Eigen::RowVector3d(4e-4, 0, -4e-4);
  garment.mesh.vertices.row(middle + 7) =
      0.5 * (garment.mesh.vertices.row(middle) + garment.mesh.vertices.row(middle + 8)) -
      Eigen::RowVector3d(4e-4, 0, -4e-4);
  return garment;
}

TEST_P(HingeWeight, WeightLimit_KeepsSliversSolvable) {
  const Garment garment = with_slivers();
  const auto stiffest = [&](double ceiling) {
    ClothOptions options;
    options.max_hinge_weight = ceiling;
    double most = 0;
    for (const ClothHinge& hinge : make_cloth(garment, {}, options).hinges) {
      most = std::max(most, hinge.stiffness / garment.material.bending);
    }
    return most;
  };
  const double length = 0.02 * std::sqrt(2.0);
  const double areas = 2 * 0.5 * length * 4e-4 * std::sqrt(2.0);
  EXPECT_NEAR(stiffest(1000), length * length / areas, 1e-6 * length * length / areas);
  EXPECT_DOUBLE_EQ(stiffest(12), 12);
  EXPECT_DOUBLE_EQ(stiffest(2), 2);
  // What is not at the ceiling is as before.
  ClothOptions low;
  low.max_hinge_weight = 12;
  ClothOptions high;
  high.max_hinge_weight = 1000;
  const std::vector<ClothHinge> held = make_cloth(garment, {}, low).hinges;
  const std::vector<ClothHinge> free = make_cloth(garment, {}, high).hinges;
  ASSERT_EQ(held.size(), free.size());
  for (std::size_t i = 0; i < held.size(); ++i) {
    EXPECT_DOUBLE_EQ(held[i].stiffness, std::min(free[i].stiffness, 12 * 1e-5));
  }
  ClothSolver solver(make_cloth(garment, {0, 6}, low), {}, {}, device());
  FrameReport report;
  for (int i = 0; i < 60; ++i) {
    report = solver.advance({});
  }
  EXPECT_LT(report.strain_p95, 0.2);
  EXPECT_LT(report.kinetic_energy, 0.01);
}

ATELIER_ON_EVERY_DEVICE(CrossShear);
ATELIER_ON_EVERY_DEVICE(HingeWeight);

TEST(ClothOptionsRefused, OptionsWithoutOrWithDoubleEffect_AreRefused) {
  Garment garment = fixtures::garment_of(fixtures::sheet(4, 4, 0.02), 0.2, 300, 1e-5);
  fixtures::use_flat_rest(garment);
  const auto refused = [](const Garment& of, const ClothOptions& options,
                          const std::vector<int>& pins, const std::string& words) {
    try {
      make_cloth(of, pins, options);
      ADD_FAILURE() << "accepted: " << words;
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  for (const char* shear : {"cross", "quads"}) {
    ClothOptions twice;
    twice.membrane = "strain";
    twice.shear = shear;
    refused(garment, twice, {}, "these triangles have their shear already");
  }
  ClothOptions quads;
  quads.shear = "quads";
  EXPECT_NO_THROW(make_cloth(garment, {}, quads));
  Mesh slanted = garment.mesh;  // every cell a rhombus
  for (Index v = 0; v < slanted.vertices.rows(); ++v) {
    slanted.vertices(v, 0) += 0.5 * slanted.vertices(v, 2);
  }
  refused(fixtures::garment_of(slanted, 0.2, 300, 1e-5), quads, {},
          "no two triangles that form a rectangle");
  ClothOptions tethers;
  tethers.tether_stretch = 1.1;
  refused(garment, tethers, {}, "no fixed vertex");
  EXPECT_EQ(make_cloth(garment, {0}, tethers).tethers.size(), 24U);
  for (const double little : {1e-3, 0.5, 1.0}) {
    tethers.tether_stretch = little;
    refused(garment, tethers, {0}, "0 for no tethers");
  }
  tethers.tether_stretch = 2.5;
  refused(garment, tethers, {0}, "tether_stretch");
  ClothOptions weight;
  weight.max_hinge_weight = 1;
  refused(garment, weight, {}, "max_hinge_weight");
  ClothOptions seam;
  seam.seam_stiffness = 0;
  refused(garment, seam, {}, "seam_stiffness");
  ClothOptions rest;
  rest.rest_angles = "bent";
  refused(garment, rest, {}, "rest_angles");
}

// Shear and bending may be 0, stretching not: the cloth would be dust.
TEST(ClothOptionsRefused, ZeroStretchStiffness_IsRefused) {
  Garment garment = fixtures::garment_of(fixtures::sheet(4, 4, 0.02), 0.2, 300, 1e-5);
  fixtures::use_flat_rest(garment);
  ClothOptions strain;
  strain.membrane = "strain";
  for (double Material::*stretch : {&Material::stretch_warp, &Material::stretch_weft}) {
    for (const double none : {0.0, -0.0, -300.0, std::nan("")}) {
      Garment broken = garment;
      broken.material.*stretch = none;
      EXPECT_THROW(make_cloth(broken), DataError) << none;
      EXPECT_THROW(make_cloth(broken, {}, strain), DataError) << none;
    }
  }
  garment.material.shear = garment.material.bending = 0;
  EXPECT_NO_THROW(make_cloth(garment));
  EXPECT_NO_THROW(make_cloth(garment, {}, strain));
}

class SoftestCloth : public fixtures::DeviceTest {};

// The inverse of such stiffnesses is infinite in float.
TEST_P(SoftestCloth, SoftestCloth_FallsAsItsPoints) {
  Garment garment = fixtures::garment_of(fixtures::sheet(4, 4, 0.02), 0.2, 1e-42, 1e-42);
  fixtures::use_flat_rest(garment);
  garment.material.shear = 1e-42;
  for (const char* membrane : {"springs", "strain"}) {
    ClothOptions options;
    options.membrane = membrane;
    const Cloth cloth = make_cloth(garment, {}, options);
    ClothSolver solver(cloth, {}, {}, device());
    for (int i = 0; i < 6; ++i) {
      solver.advance({});
    }
    const double time = 0.1;
    const double step = 1.0 / 600;
    const Points fallen = solver.state().positions - cloth.rest_positions;
    EXPECT_LT((fallen.col(1).array() + 0.5 * 9.81 * time * (time + step)).abs().maxCoeff(), 1e-5);
  }
}
ATELIER_ON_EVERY_DEVICE(SoftestCloth);

}  // namespace
}  // namespace atelier
