#include "tests/simulation/elastica.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "simulation/material/bending_rigidity.h"
#include "tests/support/devices.h"

namespace atelier {
namespace {

class Cantilever : public fixtures::DeviceTest {};
class HeartLoop : public fixtures::DeviceTest {};

XpbdOptions statics(double time_step, int substeps, double damping) {
  XpbdOptions options;
  options.time_step = time_step;
  options.substeps = substeps;
  options.precision = "double";
  options.report = false;
  options.velocity_damping = damping;
  return options;
}

using fixtures::Across;
using fixtures::kLength;
using fixtures::strip;
using fixtures::Tip;

/// The free end of a strip with that load number.
Tip tip_of(Mesh mesh, double gamma, Across across, Device device) {
  const fixtures::ClampedStrip held = fixtures::clamped_strip(std::move(mesh), gamma, across);
  ClothSolver solver(held.cloth, {}, statics(held.slow / 60, 600, 20 / held.slow), device);
  return fixtures::tip_at(held.mesh, fixtures::settle(solver, {}, 200, 1e-6).positions);
}

double tip_drop(Mesh mesh, double gamma, Across across, Device device) {
  return tip_of(std::move(mesh), gamma, across, device).drop;
}

// T7: against the exact elastica, each figure within 2% of it.
TEST_P(Cantilever, LoadedCantilever_MatchesTheElastica) {
  for (const fixtures::ElasticaRow& row : fixtures::kElastica) {
    const Tip tip = tip_of(strip('e', 20), row.gamma, Across::Straight, device());
    const auto check = [&](const char* of, double found, double expected) {
      EXPECT_NEAR(found / expected, 1, 0.02) << of << ", gamma " << row.gamma;
      RecordProperty(std::string(of) + "_off_at_" + std::to_string(row.gamma),
                     std::to_string(found / expected - 1));
    };
    check("drop", tip.drop, row.drop);
    check("out", tip.out, row.out);
    check("chord", tip.chord(), row.chord);
    check("slope", tip.slope, row.slope);
  }
}

// What the lattice's own Poisson's ratio makes of a strip that may curl: that of B (1 - 1/9).
TEST_P(Cantilever, NarrowFreeStrip_IsSofterByANinth) {
  for (const double gamma : {0.1, 5.0}) {
    const double free = tip_drop(strip('e', 20, 4), gamma, Across::Free, device());
    const double expected = tip_drop(strip('e', 20), gamma * 9 / 8, Across::Straight, device());
    EXPECT_GT(free, 0.94 * expected);
    EXPECT_LT(free, 1.01 * expected);
    RecordProperty("off_at_" + std::to_string(gamma), std::to_string(free / expected - 1));
  }
}

/// The same strip of isotropic triangles, no two alike: inner vertices moved at random.
Mesh jittered_strip(int elements, unsigned seed) {
  Mesh mesh = strip('e', elements, 4);
  const double row = kLength / elements;
  const double right = mesh.vertices.col(0).maxCoeff();
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto random = [&] {
      seed = seed * 1664525U + 1013904223U;
      return (static_cast<double>(seed >> 8) / (1U << 24) - 0.5) * 0.5 * row;
    };
    const bool inside = mesh.vertices(v, 0) > 1e-6 && mesh.vertices(v, 0) < right - 1e-6 &&
                        mesh.vertices(v, 2) > 1e-6 && mesh.vertices(v, 2) < kLength - 1e-6;
    if (inside) {
      mesh.vertices(v, 0) += random();
      mesh.vertices(v, 2) += random();
    }
  }
  return mesh;
}

// T9: the drape does not change when isotropic triangles are refined or moved.
TEST_P(Cantilever, IsotropicMeshes_DroopAlike) {
  const double fine = tip_drop(strip('e', 28, 4), 10, Across::Free, device());
  const double coarse = tip_drop(strip('e', 14, 4), 10, Across::Free, device());
  EXPECT_NEAR(coarse / fine, 1, 0.05);
  RecordProperty("coarse", std::to_string(coarse / fine - 1));
  for (const unsigned seed : {1U, 2U}) {
    const double moved = tip_drop(jittered_strip(20, seed), 10, Across::Free, device());
    EXPECT_NEAR(moved / fine, 1, 0.05) << "seed " << seed;
    RecordProperty("jittered_" + std::to_string(seed), std::to_string(moved / fine - 1));
  }
}

ATELIER_ON_EVERY_DEVICE(Cantilever);

/// Distance from the clamp to the lowest point of a loop, over its length.
double heart_loop(double load, Device device) {
  const fixtures::HeartLoopScene loop = fixtures::heart_loop_scene(load);
  ClothSolver solver(loop.cloth, {}, statics(loop.frame, 600, 0.5 / loop.frame), device);
  solver.set_state(loop.start);
  const ClothState state = fixtures::settle(solver, loop.control, 30, 1e-6);
  return -state.positions.col(1).minCoeff() / kLength;
}

// T8: Peirce's loop, without weight and with.
TEST_P(HeartLoop, Loop_HangsAsTheElastica) {
  for (const fixtures::HeartLoopRow& row : fixtures::kHeartLoops) {
    const double drop = heart_loop(row.load, device());
    EXPECT_NEAR(drop / row.drop, 1, 0.02) << "load " << row.load;
    RecordProperty("error_at_" + std::to_string(row.load), std::to_string(drop / row.drop - 1));
  }
}

ATELIER_ON_EVERY_DEVICE(HeartLoop);

/// Delaunay triangles of points strewn over a square of 0.1 m without regard to each other (Bowyer
/// and Watson: what a new point lies in the circle of makes way).
Mesh strewn_sheet(int count, std::uint64_t seed) {
  using Corner = Eigen::Vector2d;
  Random random{seed, 0, 0};
  std::vector<Corner> points{{-10, -10}, {10, -10}, {0, 10}};
  std::vector<Eigen::Vector3i> faces{{0, 1, 2}};
  const auto cross = [](const Corner& a, const Corner& b) { return a.x() * b.y() - a.y() * b.x(); };
  const auto in_circle = [&](const Eigen::Vector3i& face, const Corner& p) {
    const Corner a = points[face[0]] - p;
    const Corner b = points[face[1]] - p;
    const Corner c = points[face[2]] - p;
    return a.squaredNorm() * cross(b, c) + b.squaredNorm() * cross(c, a) +
               c.squaredNorm() * cross(a, b) >
           0;
  };
  for (int i = 0; i < count; ++i) {
    const double x = 0.1 * uniform(random);
    const Corner p(x, 0.1 * uniform(random));
    std::set<std::pair<int, int>> rim;  // directed edges without their reverse
    std::vector<Eigen::Vector3i> kept;
    for (const Eigen::Vector3i& face : faces) {
      if (!in_circle(face, p)) {
        kept.push_back(face);
        continue;
      }
      for (int k = 0; k < 3; ++k) {
        const int a = face[k];
        const int b = face[(k + 1) % 3];
        if (rim.erase({b, a}) == 0) {
          rim.insert({a, b});
        }
      }
    }
    for (const auto& [a, b] : rim) {
      kept.emplace_back(a, b, static_cast<int>(points.size()));
    }
    points.push_back(p);
    faces = kept;
  }
  // Slivers stand at the hull, where points are seen from far away.
  std::erase_if(faces, [&](const Eigen::Vector3i& face) {
    const auto outer = [&](int v) {
      const Corner& p = points[v];
      return p.minCoeff() < 0.005 || p.maxCoeff() > 0.095;
    };
    return face.minCoeff() < 3 || (outer(face[0]) && outer(face[1]) && outer(face[2]));
  });
  Mesh mesh;
  std::vector<int> place(points.size(), -1);
  mesh.vertices.resize(static_cast<Index>(points.size()), 3);
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  Index used = 0;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      int& at = place[faces[f][k]];
      if (at < 0) {
        const Corner& p = points[faces[f][k]];
        mesh.vertices.row(used) << p.x(), 0, p.y();
        at = static_cast<int>(used++);
      }
      mesh.faces(static_cast<Index>(f), k) = at;
    }
  }
  mesh.vertices.conservativeResize(used, 3);
  return mesh;
}

// T9: a mesh of triangles of any shape is stiffer than the plate, in all directions alike.
TEST(BendingRigidity, RandomPoints_GiveOneAndAHalfTimesThePlate) {
  ClothOptions options;
  options.min_rest_angle = 0.01;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const BendingRigidity strewn =
        bending_rigidity(fixtures::garment_of(strewn_sheet(1500, seed), 0.2, 100, 1), 36, options);
    EXPECT_NEAR(strewn.mean / 1.49, 1, 0.1) << "seed " << seed;
    EXPECT_GT(strewn.lowest, 0) << "seed " << seed;
    const double anisotropy = strewn.highest / strewn.lowest;
    EXPECT_LT(anisotropy, 1.2) << "seed " << seed;
    RecordProperty("strewn_" + std::to_string(seed), std::to_string(strewn.mean));
    RecordProperty("anisotropy_" + std::to_string(seed), std::to_string(anisotropy));
  }
}

// T9: what is said of each kind of mesh.
TEST(BendingRigidity, LatticeTriangles_HaveTheirKnownRigidity) {
  const auto of = [](char kind) {
    return bending_rigidity(fixtures::garment_of(fixtures::sheet(16, 16, 0.01, kind), 0.2, 100, 1));
  };
  const BendingRigidity equilateral = of('e');
  EXPECT_NEAR(equilateral.lowest, 1, 0.02);
  EXPECT_NEAR(equilateral.highest, 1, 0.02);
  const BendingRigidity diagonal = of('d');
  EXPECT_NEAR(diagonal.by_direction[0], 1, 0.02);
  EXPECT_NEAR(diagonal.by_direction[18], 1, 0.02);
  EXPECT_NEAR(diagonal.lowest, 0.75, 0.02);
  EXPECT_NEAR(diagonal.highest, 3, 0.05);
  const BendingRigidity alternating = of('a');
  EXPECT_NEAR(alternating.lowest, 1, 0.05);
  EXPECT_NEAR(alternating.highest, 1.5, 0.05);
  const BendingRigidity jittered =
      bending_rigidity(fixtures::garment_of(jittered_strip(40, 5), 0.2, 100, 1));
  EXPECT_GT(jittered.lowest, 0);
  EXPECT_LT(jittered.highest, 1.2 * jittered.lowest);
  RecordProperty("jittered_mean", std::to_string(jittered.mean));
  EXPECT_EQ(diagonal.by_direction.size(), 36U);
}

TEST(BendingRigidity, SizeAndOrientation_DoNotChangeRigidity) {
  Garment garment = fixtures::garment_of(fixtures::sheet(12, 12, 0.01, 'd'), 0.2, 100, 1);
  const BendingRigidity flat = bending_rigidity(garment);
  garment.mesh.vertices *= 7;
  EXPECT_NEAR(bending_rigidity(garment).mean, flat.mean, 1e-9);
  fixtures::use_flat_rest(garment);
  EXPECT_NEAR(bending_rigidity(garment).mean, flat.mean, 1e-9);
  garment.mesh.vertices.col(1).swap(garment.mesh.vertices.col(2));
  EXPECT_NEAR(bending_rigidity(garment).highest, flat.highest, 1e-9);
  EXPECT_THROW(bending_rigidity(garment, 0), LogicError);
}

}  // namespace
}  // namespace atelier
