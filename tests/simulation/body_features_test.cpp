#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "simulation/crossings.h"
#include "tests/simulation/cloth_fixtures.h"
#include "tests/simulation/contact_guard.h"
#include "tests/simulation/test_bodies.h"

namespace atelier {
namespace {

/// A cone round the axis y, its tip at `tip`.
Mesh cone(double radius, double height, double tip, int around) {
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
Mesh bar(double side, double length, double top) {
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

struct Pierced {
  int most = 0;
  int last = 0;
  double deepest = 0;
  double lowest_middle = 1e30;
  double strain = 0;
};

/// Moves a body by `way` a frame under a sheet pinned at its rim.
Pierced push_into(const Mesh& body, const Garment& garment, bool pinned, Eigen::RowVector3d way,
                  int moving, int frames, XpbdOptions options, Device device) {
  const double half = garment.mesh.vertices.col(0).maxCoeff() - 1e-6;
  const double low = garment.mesh.vertices.col(0).minCoeff() + 1e-6;
  const std::vector<int> rim = fixtures::vertices_where(
      garment.mesh.vertices, [&](double x, double, double) { return x > half || x < low; });
  const Cloth cloth = make_cloth(garment, pinned ? rim : std::vector<int>{});
  ClothSolver solver(cloth, body.faces, options, device);
  Pierced out;
  for (int i = 0; i < frames; ++i) {
    Control control;
    control.body_start = body.vertices.rowwise() + way * std::min(i, moving);
    control.body_end = body.vertices.rowwise() + way * std::min(i + 1, moving);
    const FrameReport report = solver.advance(control);
    out.strain = std::max(out.strain, report.strain_max);
    const Points x = solver.state().positions;
    out.last = count_crossings(x, cloth.faces, control.body_end, body.faces);
    out.most = std::max(out.most, out.last);
    out.deepest = std::max(out.deepest, fixtures::contact_guard(x, control.body_end, body.faces,
                                                                garment.material.thickness)
                                            .deepest);
  }
  return out;
}

void say(const char* what, const Pierced& p) {
  printf("%s: most %d last %d deepest %.3f mm strain %.2f\n", what, p.most, p.last, 1e3 * p.deepest,
         p.strain);
}

TEST(BodyFeatures, Explore) {
  for (bool on : {false, true}) {
    for (bool self : {false, true}) {
      XpbdOptions options;
      options.body_edges = on;
      options.self_contact = self;
      printf("features %d self %d\n", on, self);
      for (double shift : {0.0, 0.01, 0.02}) {
        say("cone", push_into(cone(0.015, 0.1, -0.01, 12), coarse_sheet(8, 0.4, shift), true,
                              {0, 0.002, 0}, 30, 40, options, Device::Cpu));
      }
      say("cone fast", push_into(cone(0.015, 0.1, -0.05, 12), coarse_sheet(8, 0.4, 0.01), true,
                                 {0, 0.05, 0}, 3, 10, options, Device::Cpu));
      say("bar", push_into(bar(0.02, 0.6, -0.01), coarse_sheet(8, 0.4, 0.013), true, {0, 0.002, 0},
                           30, 40, options, Device::Cpu));
      say("bar from the side", push_into(bar(0.02, 0.6, -0.012), coarse_sheet(8, 0.4, 0.013), true,
                                         {0.01, 0.002, 0}, 10, 40, options, Device::Cpu));
      say("bar drop", push_into(bar(0.02, 0.6, -0.01), coarse_sheet(8, 0.4, 0.013), false,
                                {0, 0, 0}, 30, 60, options, Device::Cpu));
      Mesh cube = fixtures::cube(-0.01);
      say("cube edge drop", push_into(cube, coarse_sheet(8, 0.4, 0.413), false, {0, 0, 0}, 30, 60,
                                      options, Device::Cpu));
    }
  }
}

}  // namespace
}  // namespace atelier
