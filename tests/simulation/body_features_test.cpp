#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/device.h"
#include "core/error.h"
#include "core/parallel.h"
#include "simulation/contact/crossings.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/contact_guard.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

/// A cone round the axis y, its tip at `tip`.
Mesh cone_at(double radius, double height, double tip, int around) {
  Mesh mesh;
  mesh.vertices.resize(around + 2, 3);
  mesh.faces.resize(2 * around, 3);
  for (int i = 0; i < around; ++i) {
    const double angle = 2 * std::numbers::pi * i / around;
    mesh.vertices.row(i) << radius * std::cos(angle), tip - height, radius * std::sin(angle);
    const int next = (i + 1) % around;
    mesh.faces.row(2 * i) << i, around, next;
    mesh.faces.row(2 * i + 1) << i, next, around + 1;
  }
  mesh.vertices.row(around) << 0, tip, 0;
  mesh.vertices.row(around + 1) << 0, tip - height, 0;
  return mesh;
}

/// A bar of square section along z, standing on an edge: its upper edge lies at x = z = 0, y = top.
Mesh bar_at(double side, double length, double top) {
  Mesh mesh = fixtures::cube(0.5);
  mesh.vertices.col(0) *= side;
  mesh.vertices.col(1) *= side;
  mesh.vertices.col(2) *= length;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(std::numbers::pi / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  mesh.vertices = (mesh.vertices * turn.transpose()).eval();
  mesh.vertices.col(1).array() += top - side / std::numbers::sqrt2;
  return mesh;
}

/// A sheet round the axis y, `shift` to the side, at height 0.
Garment coarse_sheet(int cells, double size, double shift) {
  Garment garment =
      fixtures::garment_of(fixtures::sheet(cells, cells, size / cells, 'a'), 0.2, 400, 2e-6);
  garment.mesh.vertices.col(0).array() += shift - size / 2;
  garment.mesh.vertices.col(2).array() += shift - size / 2;
  garment.material.thickness = 2e-3;
  garment.material.friction = 0.3;
  return garment;
}

/// What a body did to a sheet.
struct Pushed {
  int max_pierced = 0;
  int last_pierced = 0;
  double deepest = 0;
  double max_strain = 0;
  Points end;
};

XpbdOptions with_edges() {
  XpbdOptions options;
  options.body_edges = true;
  return options;
}

/// How a body moves: by `step` in each of so many frames, then it rests.
struct BodyWay {
  Eigen::RowVector3d step{0, 0.002, 0};
  int moving = 30;
  int frames = 40;
};

/// Moves a body against a sheet; `pinned`: by its two sides.
Pushed push_body(const Mesh& body, const Garment& garment, bool pinned, const BodyWay& way,
                 const XpbdOptions& options, Device device) {
  const double high = garment.mesh.vertices.col(0).maxCoeff() - 1e-6;
  const double low = garment.mesh.vertices.col(0).minCoeff() + 1e-6;
  const std::vector<int> sides = fixtures::vertices_where(
      garment.mesh.vertices, [&](double x, double, double) { return x > high || x < low; });
  const Cloth cloth = make_cloth(garment, pinned ? sides : std::vector<int>{});
  ClothSolver solver(cloth, body.faces, options, device);
  Pushed out;
  for (int i = 0; i < way.frames; ++i) {
    Control control;
    control.body_start = body.vertices.rowwise() + way.step * std::min(i, way.moving);
    control.body_end = body.vertices.rowwise() + way.step * std::min(i + 1, way.moving);
    const FrameReport report = solver.advance(control);
    out.max_strain = std::max(out.max_strain, report.strain_max);
    out.end = solver.state().positions;
    out.last_pierced = count_crossings(out.end, cloth.faces, control.body_end, body.faces);
    out.max_pierced = std::max(out.max_pierced, out.last_pierced);
    out.deepest = std::max(
        out.deepest,
        fixtures::contact_guard(out.end, control.body_end, body.faces, garment.material.thickness)
            .deepest);
  }
  return out;
}

/// Runs a case on every device, with and without contact of the cloth with itself, and without the
/// body's edges, where it is pierced.
void expect_not_pierced(const Mesh& body, const Garment& garment, bool pinned, const BodyWay& way,
                        double max_strain) {
  for (Device device : fixtures::devices()) {
    for (bool self : {false, true}) {
      XpbdOptions options = with_edges();
      options.self_contact = self;
      const Pushed course = push_body(body, garment, pinned, way, options, device);
      EXPECT_EQ(course.max_pierced, 0) << self;
      EXPECT_LT(course.deepest, 1e-4) << self;
      EXPECT_LT(course.max_strain, max_strain) << self;
    }
    EXPECT_GT(push_body(body, garment, pinned, way, {}, device).max_pierced, 0);
  }
}

TEST(BodyFeatures, TipBetweenClothVertices_DoesNotPierce) {
  // On a vertex, in the middle of an edge, in a triangle.
  for (double shift : {0.0, 0.01, 0.02}) {
    SCOPED_TRACE(shift);
    expect_not_pierced(cone_at(0.015, 0.1, -0.01, 12), coarse_sheet(8, 0.4, shift), true, {}, 0.15);
  }
}

TEST(BodyFeatures, FastTip_DoesNotPassThrough) {
  // 3 m/s: 5 mm a substep, five times the gap.
  expect_not_pierced(cone_at(0.015, 0.1, -0.05, 12), coarse_sheet(8, 0.4, 0.01), true,
                     {{0, 0.05, 0}, 3, 10}, 0.5);
}

TEST(BodyFeatures, EdgeBetweenClothVertices_DoesNotPierce) {
  expect_not_pierced(bar_at(0.02, 0.6, -0.01), coarse_sheet(8, 0.4, 0.013), true, {}, 0.15);
}

TEST(BodyFeatures, EdgeFromTheSide_DoesNotPierce) {
  expect_not_pierced(bar_at(0.02, 0.6, -0.012), coarse_sheet(8, 0.4, 0.013), true,
                     {{0.01, 0.002, 0}, 10, 40}, 0.15);
}

TEST(BodyFeatures, SheetFallingOnAnEdge_IsNotPierced) {
  expect_not_pierced(bar_at(0.02, 0.6, -0.01), coarse_sheet(8, 0.4, 0.013), false,
                     {{0, 0, 0}, 0, 60}, 0.15);
  // Half on a cube's top, half beside it.
  expect_not_pierced(fixtures::cube(-0.01), coarse_sheet(8, 0.4, 0.413), false, {{0, 0, 0}, 0, 60},
                     0.15);
}

TEST(BodyFeatures, FrictionOnAnEdge_DragsTheCloth) {
  for (Device device : fixtures::devices()) {
    double moved[2];
    for (int rough : {0, 1}) {
      Garment garment = coarse_sheet(8, 0.4, 0.013);
      garment.material.friction = rough;
      const Mesh body = bar_at(0.02, 1.2, 0.03);
      const std::vector<int> sides = fixtures::vertices_where(
          garment.mesh.vertices,
          [](double x, double, double) { return std::abs(x - 0.013) > 0.199; });
      const Cloth cloth = make_cloth(garment, sides);
      ClothSolver solver(cloth, body.faces, with_edges(), device);
      for (int i = 0; i < 60; ++i) {
        Control control;
        const auto at = [&](int frame) -> Points {
          return body.vertices.rowwise() + Eigen::RowVector3d(0, 0.001 * std::min(frame, 30) - 0.04,
                                                              0.005 * std::max(0, frame - 30));
        };
        control.body_start = at(i);
        control.body_end = at(i + 1);
        solver.advance(control);
      }
      moved[rough] = (solver.state().positions - garment.mesh.vertices).col(2).mean();
    }
    EXPECT_LT(std::abs(moved[0]), 1e-4);
    EXPECT_GT(moved[1], 5e-4);
  }
}

// The far side of a thin part is no way out.
TEST(BodyFeatures, ThinPart_DoesNotPullThroughItsOtherSide) {
  Mesh plate = fixtures::cube(0.5);
  plate.vertices.col(0) *= 0.05;
  plate.vertices.col(1) *= 0.003;
  plate.vertices.col(2) *= 0.6;
  plate.vertices.col(1).array() -= 0.006;
  expect_not_pierced(plate, coarse_sheet(8, 0.4, 0.013), true, {}, 0.15);
}

TEST(BodyFeatures, SlightPenetration_IsTakenBackGently) {
  const Mesh body = bar_at(0.02, 0.6, 5e-4);
  const Garment garment = coarse_sheet(8, 0.4, 0.013);
  for (Device device : fixtures::devices()) {
    ASSERT_GT(count_crossings(garment.mesh.vertices, garment.mesh.faces, body.vertices, body.faces),
              0);
    const Pushed course = push_body(body, garment, true, {{0, 0, 0}, 0, 30}, with_edges(), device);
    EXPECT_EQ(course.last_pierced, 0);
    EXPECT_LT(course.max_strain, 0.15);
  }
}

// What the cloth's vertices keep out by their thickness has no sharp features.
TEST(BodyFeatures, SmoothBody_GivesTheSameBitsWithoutFeatures) {
  const Mesh ball = fixtures::sphere(0.2, 24, 48);
  Garment garment = coarse_sheet(40, 0.4, 0);
  garment.mesh.vertices.col(1).array() += 0.205;
  const Cloth cloth = make_cloth(garment);
  for (Device device : fixtures::devices()) {
    Points end[2];
    for (int on : {0, 1}) {
      XpbdOptions options;
      options.body_edges = on != 0;
      ClothSolver solver(cloth, ball.faces, options, device);
      Control control;
      control.body_start = ball.vertices;
      control.body_end = ball.vertices;
      for (int i = 0; i < 20; ++i) {
        solver.advance(control);
      }
      end[on] = solver.state().positions;
    }
    EXPECT_EQ(end[0], end[1]) << device_name(device);
  }
}

TEST(BodyFeatures, AnyThreadCount_GivesTheSameBits) {
  const Garment garment = coarse_sheet(8, 0.4, 0.013);
  for (Device device : fixtures::devices()) {
    Points reference;
    for (int threads : {0, 1, 3}) {
      set_thread_count(threads);
      const Points end =
          push_body(bar_at(0.02, 0.6, -0.01), garment, true, {}, with_edges(), device).end;
      reference = reference.rows() == 0 ? end : reference;
      EXPECT_EQ(end, reference) << threads;
    }
    set_thread_count(0);
  }
}

TEST(BodyFeatures, CpuAndCudaFeatures_Agree) {
  if (!cuda_available()) {
    GTEST_SKIP() << "no CUDA device on this machine";
  }
  for (const char* precision : {"float", "double"}) {
    for (bool self : {false, true}) {
      for (const char* barrier : {"auto", "block", "grid", "graph"}) {
        XpbdOptions options = with_edges();
        options.precision = precision;
        options.self_contact = self;
        options.iterations = 2;
        options.cuda_barrier = self && barrier == std::string("graph") ? "grid" : barrier;
        const BodyWay way{{0, 0.002, 0}, 8, 10};
        const Garment garment = coarse_sheet(8, 0.4, 0.013);
        for (const Mesh& body : {bar_at(0.02, 0.6, -0.01), cone_at(0.015, 0.1, -0.01, 12)}) {
          const Pushed cpu = push_body(body, garment, true, way, options, Device::Cpu);
          const Pushed cuda = push_body(body, garment, true, way, options, Device::Cuda);
          EXPECT_LT((cpu.end - cuda.end).rowwise().norm().maxCoeff(),
                    precision[0] == 'd' ? 1e-9 : 2e-4)
              << precision << self << barrier;
        }
      }
    }
  }
}

TEST(BodyFeatures, SliversRimsAndNonManifoldEdges_AreHarmless) {
  Mesh body = bar_at(0.02, 0.6, -0.01);
  const Index n = body.faces.rows();
  Triangles more(n + 4, 3);
  // A face twice, one of no area, one with a corner twice, and a third face on an edge.
  more << body.faces, body.faces.row(0), Eigen::RowVector3i(0, 1, 8), Eigen::RowVector3i(2, 2, 3),
      Eigen::RowVector3i(body.faces(0, 0), body.faces(0, 1), 9);
  Points points(10, 3);
  points << body.vertices, 0.5 * (body.vertices.row(0) + body.vertices.row(1)),
      Eigen::RowVector3d(0.3, -0.2, 0.3);
  body.vertices = points;
  body.faces = more;
  for (Device device : fixtures::devices()) {
    const Pushed course =
        push_body(body, coarse_sheet(8, 0.4, 0.013), true, {}, with_edges(), device);
    EXPECT_TRUE(course.end.allFinite());
    EXPECT_LT(course.max_strain, 0.3);
  }
}

TEST(BodyFeatures, NonFiniteOrTeleportingBody_IsRefused) {
  const Mesh body = bar_at(0.02, 0.6, -0.01);
  const Cloth cloth = make_cloth(coarse_sheet(8, 0.4, 0.013));
  for (Device device : fixtures::devices()) {
    ClothSolver solver(cloth, body.faces, with_edges(), device);
    Control control;
    control.body_start = body.vertices;
    control.body_end = body.vertices;
    solver.advance(control);
    const Points good = solver.state().positions;
    control.body_end(2, 1) = std::nan("");
    EXPECT_THROW(solver.advance(control), DataError);
    control.body_end = body.vertices.array() + 2;
    EXPECT_THROW(solver.advance(control), DataError);
    control.body_end = body.vertices.topRows(5);
    EXPECT_THROW(solver.advance(control), LogicError);
    EXPECT_EQ(solver.state().positions, good);
  }
}

TEST(BodyFeatures, MissingBody_HasNoFeatures) {
  const Mesh body = bar_at(0.02, 0.6, -0.01);
  const Cloth cloth = make_cloth(coarse_sheet(8, 0.4, 0.013), {0});
  for (Device device : fixtures::devices()) {
    ClothSolver solver(cloth, body.faces, with_edges(), device);
    ClothSolver alone(cloth, {}, with_edges(), device);
    for (int i = 0; i < 3; ++i) {  // its faces are known, its vertices are not
      solver.advance({});
      alone.advance({});
    }
    EXPECT_EQ(solver.state().positions, alone.state().positions);
  }
}

}  // namespace
}  // namespace atelier
