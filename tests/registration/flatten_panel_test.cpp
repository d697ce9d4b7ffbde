#include "registration/flattening/flatten_panel.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/panel_energy.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

double turned_over(const Points2& flat, const Triangles& faces) {
  int count = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector2d ab = (flat.row(faces(f, 1)) - flat.row(faces(f, 0))).transpose();
    const Eigen::Vector2d ac = (flat.row(faces(f, 2)) - flat.row(faces(f, 0))).transpose();
    count += ab.x() * ac.y() - ab.y() * ac.x() > 0 ? 0 : 1;
  }
  return count;
}

void expect_same_edges(const Points& curved, const Points2& flat, const Triangles& faces,
                       double tolerance) {
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k);
      const int b = faces(f, (k + 1) % 3);
      const double length = (curved.row(a) - curved.row(b)).norm();
      EXPECT_NEAR((flat.row(a) - flat.row(b)).norm(), length, tolerance * length);
    }
  }
}

/// A grid of the unit square, bent.
Mesh bent_grid(int cells, const std::function<Eigen::Vector3d(double, double)>& bend) {
  Mesh mesh = fixtures::grid(cells, cells);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    mesh.vertices.row(v) = bend(mesh.vertices(v, 0), mesh.vertices(v, 2)).transpose();
  }
  return mesh;
}

TEST(FlattenPanel, FlatPanel_StaysUnchanged) {
  const Mesh mesh = fixtures::grid(8, 8);
  const FlatPanel flat = flatten_panel(mesh.vertices, mesh.faces);
  EXPECT_TRUE(flat.converged);
  EXPECT_FALSE(flat.overlaps);
  EXPECT_NEAR(flat.energy, 2, 1e-9);
  expect_same_edges(mesh.vertices, flat.vertices, mesh.faces, 1e-6);
}

TEST(FlattenPanel, Cones_UnrollToTheirChordLengths) {
  // Rows of a cone's generators: every triangle strip is developable as a polyhedron.
  const Mesh mesh = bent_grid(24, [](double u, double v) {
    const double r = 0.2 + 0.5 * v;
    return Eigen::Vector3d(r * std::cos(3 * u), v, -r * std::sin(3 * u));
  });
  const FlatPanel flat = flatten_panel(mesh.vertices, mesh.faces);
  EXPECT_TRUE(flat.converged);
  EXPECT_EQ(turned_over(flat.vertices, mesh.faces), 0);
  EXPECT_NEAR(flat.energy, 2, 1e-6);
  expect_same_edges(mesh.vertices, flat.vertices, mesh.faces, 2e-3);
}

TEST(FlattenPanel, SphereCap_IsStretchedLittleWithoutInversions) {
  Mesh mesh = fixtures::sphere(4);
  Triangles upper(0, 3);
  std::vector<int> number(static_cast<std::size_t>(mesh.vertices.rows()), -1);
  std::vector<Eigen::Vector3d> kept;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    bool in = true;
    for (int k = 0; k < 3; ++k) {
      in = in && mesh.vertices(mesh.faces(f, k), 1) >= 0.7;
    }
    if (!in) {
      continue;
    }
    upper.conservativeResize(upper.rows() + 1, 3);
    for (int k = 0; k < 3; ++k) {
      int& n = number[static_cast<std::size_t>(mesh.faces(f, k))];
      if (n < 0) {
        n = static_cast<int>(kept.size());
        kept.emplace_back(mesh.vertices.row(mesh.faces(f, k)).transpose());
      }
      upper(upper.rows() - 1, k) = n;
    }
  }
  Points vertices(static_cast<Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    vertices.row(static_cast<Index>(i)) = kept[i].transpose();
  }
  const FlatPanel flat = flatten_panel(vertices, upper);
  EXPECT_TRUE(flat.converged);
  EXPECT_EQ(turned_over(flat.vertices, upper), 0);
  EXPECT_FALSE(flat.overlaps);
  EXPECT_GT(flat.energy, 2.001);
  EXPECT_LT(flat.energy, 2.05);
}

TEST(FlattenPanel, DeepFold_HasNoInvertedFaces) {
  // Nearly the whole sphere through a small hole: no map is near isometric.
  const Mesh sphere = fixtures::sphere(3);
  const Triangles faces = sphere.faces.bottomRows(sphere.faces.rows() - 1);
  const FlatPanel flat = flatten_panel(sphere.vertices, faces);
  EXPECT_EQ(turned_over(flat.vertices, faces), 0);
  EXPECT_GT(flat.energy, 2.2);
}

TEST(FlattenPanel, SeamLengths_AreKept) {
  const Mesh mesh = fixtures::grid(6, 6);
  FlattenPanelOptions options;
  options.length_weight = 1e4;
  const double wanted = 1.05 / 6;
  std::vector<EdgeLength> lengths;
  for (int i = 0; i < 6; ++i) {
    lengths.push_back({i, i + 1, wanted});
  }
  const FlatPanel flat = flatten_panel(mesh.vertices, mesh.faces, options, lengths);
  for (const EdgeLength& edge : lengths) {
    EXPECT_NEAR((flat.vertices.row(edge.a) - flat.vertices.row(edge.b)).norm(), wanted,
                1e-3 * wanted);
  }
}

TEST(FlattenPanel, StiffeningCloth_SpreadsTheStretch) {
  // A low dome: what it must be stretched by lies at its middle and its rim if cloth is soft.
  const Mesh dome = bent_grid(20, [](double u, double v) {
    const double x = 2 * u - 1;
    const double y = 2 * v - 1;
    return Eigen::Vector3d(x, -y, 0.35 * (1 - x * x) * (1 - y * y));
  });
  const auto most = [&](double even) {
    FlattenPanelOptions options;
    options.even = even;
    const FlatPanel flat = flatten_panel(dome.vertices, dome.faces, options);
    EXPECT_TRUE(flat.converged);
    EXPECT_EQ(turned_over(flat.vertices, dome.faces), 0);
    double largest = 0;
    for (Index f = 0; f < dome.faces.rows(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int a = dome.faces(f, k);
        const int b = dome.faces(f, (k + 1) % 3);
        largest =
            std::max(largest, std::abs((flat.vertices.row(a) - flat.vertices.row(b)).norm() /
                                           (dome.vertices.row(a) - dome.vertices.row(b)).norm() -
                                       1));
      }
    }
    return largest;
  };
  EXPECT_LT(most(0.03), 0.8 * most(0));
}

TEST(FlattenPanel, Derivatives_MatchFiniteDifferences) {
  const Mesh mesh =
      bent_grid(3, [](double u, double v) { return Eigen::Vector3d(u, 0.3 * u * v, v); });
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.02);
  Eigen::VectorXd x(2 * mesh.vertices.rows());
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    x.segment<2>(2 * v) << mesh.vertices(v, 0) + noise(random),
        -mesh.vertices(v, 2) + noise(random);
  }
  // Some faces are soft, some stiffen, some are beyond.
  for (const double even : {0.0, 0.03, 0.1, 1.0}) {
    PanelEnergy energy(mesh.vertices, mesh.faces, {{0, 1, 0.3}}, 50, even);
    const Eigen::VectorXd gradient = energy.gradient(x);
    const Eigen::MatrixXd hessian =
        Eigen::MatrixXd(energy.hessian(x)).selfadjointView<Eigen::Lower>();
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd differences(x.size(), x.size());
    for (Index i = 0; i < x.size(); ++i) {
      Eigen::VectorXd plus = x;
      Eigen::VectorXd minus = x;
      plus[i] += kStep;
      minus[i] -= kStep;
      EXPECT_NEAR((energy.value(plus) - energy.value(minus)) / (2 * kStep), gradient[i], 1e-6);
      differences.col(i) = (energy.gradient(plus) - energy.gradient(minus)) / (2 * kStep);
    }
    // The projected Hessian is the exact one and more: the difference has no negative eigenvalue.
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> more(
        hessian - (differences + differences.transpose()) / 2);
    EXPECT_GT(more.eigenvalues().minCoeff(), -1e-5 * hessian.norm());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> definite(hessian);
    EXPECT_GT(definite.eigenvalues().minCoeff(), 0);
  }
}

TEST(FlattenPanel, OverlappingSpiral_IsDetected) {
  // A flat ring sector of 1.2 turns, as a helix: isometric, but it overlaps.
  const Mesh mesh = bent_grid(60, [](double u, double v) {
    const double angle = 2.4 * std::numbers::pi * u;
    const double r = 0.5 + 0.2 * v;
    return Eigen::Vector3d(r * std::cos(angle), 0.02 * u, -r * std::sin(angle));
  });
  const FlatPanel flat = flatten_panel(mesh.vertices, mesh.faces);
  EXPECT_EQ(turned_over(flat.vertices, mesh.faces), 0);
  EXPECT_TRUE(flat.overlaps);
}

TEST(CrossesItself, BowAndSquare_AreToldApart) {
  Points2 square(4, 2);
  square << 0, 0, 1, 0, 1, 1, 0, 1;
  EXPECT_FALSE(crosses_itself(square));
  Points2 bow(4, 2);
  bow << 0, 0, 1, 1, 1, 0, 0, 1;
  EXPECT_TRUE(crosses_itself(bow));
}

TEST(CrossesItself, Spikes_AreDetected) {
  Points2 spike(5, 2);  // up from the square's side and back along itself
  spike << 0, 0, 1, 0, 1, 1, 1, 2, 0, 1;
  EXPECT_FALSE(crosses_itself(spike));
  spike << 0, 0, 1, 0, 1, 2, 1, 1, 0, 1;
  EXPECT_TRUE(crosses_itself(spike));
  Points2 there_and_back(3, 2);
  there_and_back << 0, 0, 2, 0, 1, 0;
  EXPECT_TRUE(crosses_itself(there_and_back));
}

/// Which side of the line through a and b is c on: exact for small whole numbers.
int side_of(const std::array<int, 2>& a, const std::array<int, 2>& b, const std::array<int, 2>& c) {
  const int twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  return (twice_area > 0) - (twice_area < 0);
}

bool is_between(const std::array<int, 2>& a, const std::array<int, 2>& b,
                const std::array<int, 2>& c) {
  return side_of(a, b, c) == 0 && std::min(a[0], b[0]) <= c[0] && c[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= c[1] && c[1] <= std::max(a[1], b[1]);
}

/// Every pair of segments of a closed polygon, looked at by itself.
bool crosses_by_pairs(const std::vector<std::array<int, 2>>& loop) {
  const std::size_t count = loop.size();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const auto& a = loop[i];
      const auto& b = loop[(i + 1) % count];
      const auto& c = loop[j];
      const auto& d = loop[(j + 1) % count];
      const bool behind = j == i + 1;            // b is c
      const bool before = (j + 1) % count == i;  // d is a
      const bool through =
          side_of(a, b, c) * side_of(a, b, d) < 0 && side_of(c, d, a) * side_of(c, d, b) < 0;
      if (through || (!before && is_between(c, d, a)) || (!behind && is_between(c, d, b)) ||
          (!behind && is_between(a, b, c)) || (!before && is_between(a, b, d))) {
        return true;
      }
    }
  }
  return false;
}

TEST(CrossesItself, RandomLoops_AgreeWithEveryPairOfSegments) {
  std::mt19937 random(7);
  int crossing = 0;
  int apart = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::size_t count = 3 + random() % 6;
    std::vector<std::array<int, 2>> loop(count);
    Points2 points(static_cast<Index>(count), 2);
    for (std::size_t i = 0; i < count; ++i) {
      loop[i] = {static_cast<int>(random() % 6), static_cast<int>(random() % 6)};
      points.row(static_cast<Index>(i)) << loop[i][0], loop[i][1];
    }
    const bool expected = crosses_by_pairs(loop);
    ++(expected ? crossing : apart);
    ASSERT_EQ(crosses_itself(points), expected) << points;
  }
  EXPECT_GT(crossing, 1000);
  EXPECT_GT(apart, 1000);
}

template <class Act>
void expect_refused_panel(const Act& act, const std::string& words) {
  try {
    act();
    FAIL() << "not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

TEST(FlattenPanel, NonDiskPanels_AreRefused) {
  const Mesh grid = fixtures::grid(3, 3);
  expect_refused_panel([] { flatten_panel(Points(0, 3), Triangles(0, 3)); }, "no triangle");
  const Mesh sphere = fixtures::sphere(1);
  expect_refused_panel([&] { flatten_panel(sphere.vertices, sphere.faces); }, "closed");
  const Mesh tube = fixtures::tube(8, 3);
  expect_refused_panel([&] { flatten_panel(tube.vertices, tube.faces); }, "2 boundary loops");
  Points more(grid.vertices.rows() + 1, 3);
  more << grid.vertices, Eigen::RowVector3d(5, 5, 5);
  expect_refused_panel([&] { flatten_panel(more, grid.faces); }, "in no triangle");
  Points twice(2 * grid.vertices.rows(), 3);
  twice << grid.vertices, grid.vertices;
  Triangles both(2 * grid.faces.rows(), 3);
  both << grid.faces, grid.faces.array() + static_cast<int>(grid.vertices.rows());
  expect_refused_panel([&] { flatten_panel(twice, both); }, "2 pieces");
}

TEST(FlattenPanel, BadTriangles_AreRefused) {
  Mesh grid = fixtures::grid(3, 3);
  grid.vertices(5, 1) = std::numeric_limits<double>::quiet_NaN();
  expect_refused_panel([&] { flatten_panel(grid.vertices, grid.faces); }, "not finite");
  grid.vertices.row(5) = grid.vertices.row(6);
  expect_refused_panel([&] { flatten_panel(grid.vertices, grid.faces); }, "no area");
  const Mesh fin = fixtures::mesh_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}},
                                     {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  expect_refused_panel([&] { flatten_panel(fin.vertices, fin.faces); }, "non-manifold-edge");
}

TEST(FlattenPanel, StartWithAnInvertedFace_IsRefused) {
  const Mesh grid = fixtures::grid(2, 2);
  Points2 start(grid.vertices.rows(), 2);
  start << grid.vertices.col(0), grid.vertices.col(2);  // the other side
  EXPECT_THROW(flatten_panel(grid.vertices, grid.faces, {}, {}, start), LogicError);
}

}  // namespace
}  // namespace atelier
