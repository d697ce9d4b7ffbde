// Layout of woven cloth: threads that keep their length, fields of directions, set-in sleeves.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/part_of_mesh.h"
#include "registration/drafting/name_pattern.h"
#include "registration/flattening/cross_field.h"
#include "registration/flattening/find_pattern.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/flatten_panel.h"
#include "registration/flattening/grain_direction.h"
#include "registration/flattening/limb_rings.h"
#include "registration/flattening/woven_shape.h"
#include "tests/registration/cut_fixtures.h"
#include "tests/registration/pillow_tee.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A square of 2 * `half` metres, upright, on a sphere: the middle looks to +z.
Mesh sphere_patch(double radius, double half, int steps) {
  Mesh mesh = fixtures::grid(steps, steps);  // in y = 0
  const double width = mesh.vertices.col(0).maxCoeff();
  const double depth = mesh.vertices.col(2).maxCoeff();
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double x = half * (2 * mesh.vertices(v, 0) / width - 1);
    const double y = half * (2 * mesh.vertices(v, 2) / depth - 1);
    mesh.vertices.row(v) << x, y, std::sqrt(radius * radius - x * x - y * y);
  }
  return mesh;
}

double most_thread_strain(const Mesh& mesh, const Points2& flat) {
  double most = 0;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    most = std::max(
        most, thread_strain(face_deformation(mesh.vertices, mesh.faces, flat, mesh.faces, f)));
  }
  return most;
}

/// Its faces counter-clockwise seen from +z.
void turn_out(Mesh& mesh) {
  const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(0, 0));
  const Eigen::Vector3d ab = mesh.vertices.row(mesh.faces(0, 1)).transpose() - a;
  const Eigen::Vector3d ac = mesh.vertices.row(mesh.faces(0, 2)).transpose() - a;
  if (ab.x() * ac.y() - ab.y() * ac.x() < 0) {
    mesh.faces.col(1).swap(mesh.faces.col(2));
  }
}

TEST(WovenShape, Sphere_IsCoveredByShearWhereIsotropicClothStretches) {
  // A net of rods that turn at their knots covers a sphere (Chebyshev 1878): no thread stretches.
  Mesh mesh = sphere_patch(0.2, 0.09, 16);
  turn_out(mesh);
  const FlatPanel isotropic = flatten_panel(mesh.vertices, mesh.faces);
  FlattenPanelOptions woven;
  woven.woven = true;
  const FlatPanel threads = flatten_panel(mesh.vertices, mesh.faces, woven);
  EXPECT_EQ(turned_faces(threads.vertices, mesh.faces), 0);
  const double before =
      most_thread_strain(mesh, turned_to_grain(mesh.vertices, mesh.faces, isotropic.vertices));
  const double after = most_thread_strain(mesh, threads.vertices);
  EXPECT_GT(before, 0.02);
  EXPECT_LT(after, before / 3);
}

TEST(WovenShape, Iterations_ComeToRest) {
  // Threads that stiffen overshoot in full steps, which go to and fro for ever.
  Mesh mesh = sphere_patch(0.15, 0.1, 16);
  turn_out(mesh);
  const FlatPanel isotropic = flatten_panel(mesh.vertices, mesh.faces);
  WovenShapeOptions options;
  options.iterations = 20;
  const Points2 flat = woven_shape(mesh.vertices, mesh.faces, isotropic.vertices, options);
  options.iterations = 1;
  const Points2 again = woven_shape(mesh.vertices, mesh.faces, flat, options);
  EXPECT_LT((again - flat).rowwise().norm().maxCoeff(), 1e-3);
}

TEST(WovenShape, SheetAndTube_KeepTheirShape) {
  Mesh sheet = sphere_patch(50, 0.2, 12);
  turn_out(sheet);
  FlattenPanelOptions woven;
  woven.woven = true;
  const FlatPanel flat = flatten_panel(sheet.vertices, sheet.faces, woven);
  EXPECT_LT(most_thread_strain(sheet, flat.vertices), 1e-4);
  for (Index f = 0; f < sheet.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = sheet.faces(f, k);
      const int b = sheet.faces(f, (k + 1) % 3);
      EXPECT_NEAR((flat.vertices.row(a) - flat.vertices.row(b)).norm(),
                  (sheet.vertices.row(a) - sheet.vertices.row(b)).norm(), 1e-5);
    }
  }
  // The grain is upright.
  EXPECT_NEAR(grain_direction(sheet.vertices, sheet.faces, flat.vertices).y(), 1, 1e-6);
}

TEST(WovenShape, LengthsAndStarts_AreKeptAndChecked) {
  Mesh mesh = sphere_patch(0.2, 0.09, 8);
  turn_out(mesh);
  FlattenPanelOptions woven;
  woven.woven = true;
  const FlatPanel free = flatten_panel(mesh.vertices, mesh.faces, woven);
  const int a = mesh.faces(0, 0);
  const int b = mesh.faces(0, 1);
  const double length = 1.02 * (free.vertices.row(a) - free.vertices.row(b)).norm();
  woven.length_weight = 1e3;
  const FlatPanel held =
      flatten_panel(mesh.vertices, mesh.faces, woven, {{a, b, length}}, free.vertices);
  EXPECT_NEAR((held.vertices.row(a) - held.vertices.row(b)).norm() / length, 1, 2e-3);
  EXPECT_THROW(woven_shape(mesh.vertices, mesh.faces, free.vertices.topRows(3)), LogicError);
}

TEST(CrossField, Tube_HasItAlongItselfAndRound) {
  Mesh mesh = fixtures::tube(32, 16, 0.5);
  mesh.vertices.col(0) *= 0.1;
  mesh.vertices.col(2) *= 0.1;
  const Topology topology = fixtures::topology(mesh);
  const Points field = cross_field(mesh, topology);
  for (Index f = 0; f < field.rows(); ++f) {
    EXPECT_NEAR(field.row(f).norm(), 1, 1e-9);
    const double up = std::abs(field(f, 1));
    EXPECT_LT(std::min(up, std::sqrt(1 - std::min(1.0, up * up))), 0.02) << f;
  }
  const std::vector<double> off = off_field(mesh, topology, field);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const Eigen::RowVector3d along =
        (mesh.vertices.row(topology.edges(e, 1)) - mesh.vertices.row(topology.edges(e, 0)))
            .normalized();
    const double angle = std::asin(std::min(1.0, std::abs(along.y())));
    EXPECT_NEAR(off[static_cast<std::size_t>(e)], std::pow(std::sin(2 * angle), 2), 0.04)
        << "twice the field's own error";
  }
  EXPECT_THROW(cross_field(mesh, topology, 0), LogicError);
}

TEST(LimbRings, Tee_HasOneThroughEachArmpit) {
  const Mesh mesh = fixtures::pillow_tee();
  const Topology topology = fixtures::topology(mesh);
  const std::vector<char> cut = limb_rings(mesh, topology, Eigen::Vector3d::UnitZ());
  for (const int side : {1, -1}) {
    double length = 0;
    bool armpit = false;
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      const Eigen::RowVector3d a = mesh.vertices.row(topology.edges(e, 0));
      const Eigen::RowVector3d b = mesh.vertices.row(topology.edges(e, 1));
      if (cut[static_cast<std::size_t>(e)] == 0 || side * a.x() < 0) {
        continue;
      }
      length += (a - b).norm();
      armpit = armpit || (a - Eigen::RowVector3d(side * 0.16, 0.36, 0)).norm() < 0.03;
      EXPECT_NEAR(side * a.x(), 0.16, 0.04);
      EXPECT_GT(a.y(), 0.33);
    }
    EXPECT_TRUE(armpit) << side;
    EXPECT_GT(length, 0.2) << side;
    EXPECT_LT(length, 0.5) << side;
  }
}

TEST(LimbRings, TeeWithAnArmTooShort_HasNoneOnEitherSide) {
  const Mesh whole = fixtures::pillow_tee();
  std::vector<Index> kept;
  for (Index f = 0; f < whole.faces.rows(); ++f) {
    double most = 0;
    for (int k = 0; k < 3; ++k) {
      most = std::max(most, whole.vertices(whole.faces(f, k), 0));
    }
    if (most < 0.19) {  // 2 cm of a sleeve are left
      kept.push_back(f);
    }
  }
  const Mesh mesh = part_of_mesh(whole, kept);
  const Topology topology = fixtures::topology(mesh);
  EXPECT_EQ(limb_rings(mesh, topology, Eigen::Vector3d::UnitZ()), fixtures::no_cut(topology));
}

TEST(LimbRings, Skirt_HasNone) {
  Mesh skirt = fixtures::tube(24, 12, 0.5);
  skirt.vertices.col(0) *= 0.2;
  skirt.vertices.col(2) *= 0.2;
  const Topology topology = fixtures::topology(skirt);
  EXPECT_EQ(limb_rings(skirt, topology, Eigen::Vector3d::UnitZ()), fixtures::no_cut(topology));
  EXPECT_THROW(limb_rings(skirt, topology, {0, 0, 2}), LogicError);
}

TEST(FindPattern, WovenTee_HasSleevesOfTheirOwn) {
  const Mesh mesh = fixtures::pillow_tee();
  FindPatternOptions options;
  options.find.woven = true;
  options.find.facing = Eigen::Vector3d::UnitZ();
  options.find.bias_stretch = 0.15;  // its square edges take shear
  options.flatten.panel.woven = true;
  const FoundPattern found = find_pattern(mesh, options);
  EXPECT_TRUE(found.reached);
  EXPECT_LE(found.measures.thread_p99, options.find.thread_stretch);
  EXPECT_LE(found.measures.strain_p99, options.find.bias_stretch);
  EXPECT_EQ(found.measures.inverted, 0);
  EXPECT_EQ(found.measures.overlaps, 0);
  const PatternNames names = name_pattern(found.pattern, found.mesh, Eigen::Vector3d::UnitZ());
  const auto starting = [&](const std::string& word) {
    return std::count_if(names.panels.begin(), names.panels.end(),
                         [&](const std::string& name) { return name.starts_with(word); });
  };
  EXPECT_EQ(starting("front"), 1);
  EXPECT_EQ(starting("back"), 1);
  EXPECT_GE(starting("sleeve"), 2);
  EXPECT_LE(found.pattern.cut.panel_count, 6);
}

}  // namespace
}  // namespace atelier
