#include "simulation/contact/held_positions.h"

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "simulation/cloth/cloth.h"
#include "simulation/solver.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {
namespace {

constexpr int kAround = 60;
constexpr double kRadius = 0.12;

/// A cylinder of 12 cm radius, a triangle fan of `kAround` columns, y in [-1, 1].
Mesh column(double radius = kRadius) {
  Mesh mesh = tube(kAround, 40, 2);
  mesh.vertices.col(0) *= radius;
  mesh.vertices.col(2) *= radius;
  mesh.vertices.col(1).array() -= 1;
  return mesh;
}

/// A skirt whose upper ring, of `radius`, hangs at y = 0.
Garment skirt(double radius) {
  Garment garment;
  garment.mesh = tube(kAround, 12, 1);
  garment.mesh.vertices.col(0) *= radius;
  garment.mesh.vertices.col(2) *= radius;
  garment.mesh.vertices.col(1) = 0.3 * garment.mesh.vertices.col(1).array() - 0.3;
  garment.material.density = 0.2;
  garment.material.stretch_warp = garment.material.stretch_weft = 2000;
  garment.material.bending = 1e-5;
  return garment;
}

std::vector<int> upper_ring() {
  std::vector<int> ring;
  for (int i = 0; i < kAround; ++i) {
    ring.push_back(12 * kAround + i);
  }
  return ring;
}

/// The upper ring attached `height` over the middle of the column's triangles, where these are.
void attach(Garment& garment, const Mesh& body, double height) {
  for (int i = 0; i < kAround; ++i) {
    // Of the two triangles of a quad the first has its lower edge at y = 0.
    garment.attachments.push_back(
        {12 * kAround + i, 2 * (20 * kAround + i), {0.5, 0.5, 0}, height});
  }
  ASSERT_GT(body.faces.rows(), 2 * 21 * kAround - 1);
}

/// A garment's attachments alone, of its upper ring.
HeldCloth held_of(const Garment& garment) {
  HeldCloth held;
  held.vertices = garment.mesh.vertices.rows();
  held.attachments = garment.attachments;
  return held;
}

/// The upper ring of what is held on a body.
Points ring_on(const HeldCloth& held, const Mesh& body) {
  return held_positions(held, body.vertices, body.faces).middleRows(12 * kAround, kAround);
}

ClothBand band_of(const Garment& garment, double rest_girth, double stiffness) {
  return make_band(garment.mesh.vertices, upper_ring(), true, rest_girth, stiffness);
}

double girth_of(const Points& ring) {
  double girth = 0;
  for (Index i = 0; i < ring.rows(); ++i) {
    girth += (ring.row(i) - ring.row((i + 1) % ring.rows())).norm();
  }
  return girth;
}

double mean_radius(const Points& ring) {
  return (ring.col(0).array().square() + ring.col(2).array().square()).sqrt().mean();
}

TEST(HeldPositions, WithoutBand_AreTheAttachments) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.01);
  attach(garment, body, 0.01);
  const Points held = ring_on(held_of(garment), body);
  EXPECT_NEAR(mean_radius(held), kRadius * std::cos(std::numbers::pi / kAround) + 0.01, 1e-6);
  EXPECT_LT(held.col(1).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(HeldPositions, BandLongerThanTheBody_DoesNotPull) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.01);
  attach(garment, body, 0.01);
  HeldCloth held = held_of(garment);
  const Points free = ring_on(held, body);
  held.bands.push_back(band_of(garment, 0.9, 100));
  EXPECT_LT((ring_on(held, body) - free).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(HeldPositions, ShortBand_PullsInByItsTensionOverWhatHoldsIt) {
  // Each of n vertices with the length l of band is drawn in by 2 T sin(pi / n) against 1 kN/m2 l.
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.03);
  attach(garment, body, 0.03);
  HeldCloth held = held_of(garment);
  const double before = girth_of(ring_on(held, body));
  const double rest = 0.95 * before;
  const double stiffness = 20;
  held.bands.push_back(band_of(garment, rest, stiffness));
  const double after = girth_of(ring_on(held, body));
  const double drawn_in = (before - after) / (2 * kAround * std::sin(std::numbers::pi / kAround));
  const double tension = stiffness * (after / rest - 1);
  const double length = kAround * 2 * std::sin(std::numbers::pi / kAround) * (kRadius + 0.03);
  EXPECT_GT(tension, 0.5);
  EXPECT_NEAR(1000 * (length / kAround) * drawn_in,
              2 * tension * std::sin(std::numbers::pi / kAround), 2e-4);
}

TEST(HeldPositions, StrongBand_StopsAtTheBody) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.015);
  attach(garment, body, 0.015);
  HeldCloth held = held_of(garment);
  held.bands.push_back(band_of(garment, 0.95 * 2 * std::numbers::pi * kRadius, 5000));
  const double flat = kRadius * std::cos(std::numbers::pi / kAround);
  EXPECT_NEAR(mean_radius(ring_on(held, body)), flat + 0.004, 2e-4);  // contact_distance
}

TEST(HeldPositions, BodyThatGrows_StretchesABandNoFartherThanItHasTo) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.005);
  attach(garment, body, 0.005);
  HeldCloth held = held_of(garment);
  held.bands.push_back(band_of(garment, 0.7, 60));
  const double least = 1.1 * kRadius * std::cos(std::numbers::pi / kAround) + 0.004;
  const double radius = mean_radius(ring_on(held, column(1.1 * kRadius)));
  EXPECT_GT(radius, least - 1e-4);  // the body is not cut
  EXPECT_LT(radius, least + 0.0015);
}

TEST(HeldPositions, PlacesThatPart_DoNotTearTheCloth) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.005);
  attach(garment, body, 0.005);
  HeldCloth held = held_of(garment);
  // Skin that shears along the band: one half goes up by 6 cm, within one triangle's width.
  Mesh sheared = body;
  for (Index v = 0; v < sheared.vertices.rows(); ++v) {
    if (sheared.vertices(v, 0) > 0) {
      sheared.vertices(v, 1) += 0.06;
    }
  }
  const auto longest = [](const Points& ring) {
    double most = 0;
    for (Index i = 0; i < ring.rows(); ++i) {
      most = std::max(most, (ring.row(i) - ring.row((i + 1) % ring.rows())).norm());
    }
    return most;
  };
  const double rest = 2 * (kRadius + 0.005) * std::sin(std::numbers::pi / kAround);
  EXPECT_GT(longest(ring_on(held, sheared)), 2 * rest);
  held.bands.push_back(band_of(garment, 0.7, 60));
  EXPECT_LT(longest(ring_on(held, sheared)), 1.2 * rest);
}

class HeldSkirt : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Solvers, HeldSkirt, ::testing::ValuesIn(solver_names()),
                         [](const auto& of) { return of.param == "xpbd" ? "Xpbd" : "Projective"; });

TEST_P(HeldSkirt, BandOnMovingBody_StaysUpAndGoesOnWithTheSameBits) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.01);
  attach(garment, body, 0.01);
  HeldCloth held = held_of(garment);
  held.bands.push_back(band_of(garment, 0.7, 60));
  Cloth cloth = make_cloth(garment);
  cloth.attachments.clear();  // their vertices stay fixed, and go where they are held
  SolverOptions options;
  options.name = GetParam();
  options.time_step = 1.0 / 60;
  options.substeps = 10;
  const auto at = [&](int frame) -> Points {
    return body.vertices.rowwise() +
           Eigen::RowVector3d(0.1 * std::sin(0.3 * frame), 0.05 * std::sin(0.2 * frame), 0);
  };
  const auto run = [&](int from, int to, const ClothState& start) {
    const auto solver = create_solver({cloth, body.faces}, options);
    solver->set_state(start);
    for (int frame = from; frame < to; ++frame) {
      Control control;
      control.body_start = at(frame);
      control.body_end = at(frame + 1);
      control.pin_targets = held_positions(held, control.body_end, body.faces);
      solver->step(control);
    }
    return solver->state();
  };
  const ClothState middle = run(0, 15, rest_state(cloth));
  const ClothState end = run(15, 30, middle);
  const ClothState whole = run(0, 30, rest_state(cloth));
  EXPECT_EQ((end.positions - whole.positions).cwiseAbs().maxCoeff(), 0);
  const Points there = held_positions(held, at(30), body.faces);
  for (int i = 0; i < kAround; ++i) {
    EXPECT_LT((end.positions.row(12 * kAround + i) - there.row(12 * kAround + i)).norm(), 1e-5);
  }
  EXPECT_GT(end.positions.col(1).minCoeff(), there(12 * kAround, 1) - 0.4) << "it hangs there";
}

// As `drape` leaves it to the cloth's own attachments.
TEST_P(HeldSkirt, AttachmentsAlone_HoldItOnMovingBody) {
  const Mesh body = column();
  Garment garment = skirt(kRadius + 0.01);
  attach(garment, body, 0.01);
  SolverOptions options;
  options.name = GetParam();
  const auto solver = create_solver({make_cloth(garment), body.faces}, options);
  Control control;
  control.body_end = body.vertices;
  for (int frame = 1; frame <= 20; ++frame) {
    control.body_start = control.body_end;
    control.body_end.rowwise() += Eigen::RowVector3d(0.004, 0.01, 0);
    solver->step(control);
  }
  const Points there = held_positions(held_of(garment), control.body_end, body.faces);
  const Points end = solver->state().positions;
  EXPECT_LT((end - there).middleRows(12 * kAround, kAround).rowwise().norm().maxCoeff(), 1e-5);
  EXPECT_NEAR(end.col(1).minCoeff(), 0.2 - 0.3, 0.03) << "its hem went up with the body";
}

TEST(HeldPositions, BandOfNoVertex_IsRefused) {
  const Garment garment = skirt(kRadius + 0.01);
  const Points& rest = garment.mesh.vertices;
  EXPECT_THROW(make_band(rest, {5}, true, 0.7, 60), LogicError);
  EXPECT_THROW(make_band(rest, {5, 13 * kAround}, true, 0.7, 60), LogicError);
  HeldCloth loose = held_of(garment);
  loose.bands.push_back(make_band(rest, {0, 1, 2}, false, 0.7, 60));
  const Mesh body = column();
  EXPECT_THROW(held_positions(loose, body.vertices, body.faces), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
