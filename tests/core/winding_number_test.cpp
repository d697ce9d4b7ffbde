#include "core/winding_number.h"

#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/random.h"
#include "tests/support/devices.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

Points scattered_points(Index n, double size, std::uint64_t seed) {
  Random random{seed};
  Points points(n, 3);
  for (Index i = 0; i < points.size(); ++i) {
    points.data()[i] = uniform(random, -size, size);
  }
  return points;
}

Mesh join(const Mesh& a, const Mesh& b) {
  Mesh both;
  both.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  both.vertices << a.vertices, b.vertices;
  both.faces.resize(a.faces.rows() + b.faces.rows(), 3);
  both.faces << a.faces, b.faces.array() + static_cast<int>(a.vertices.rows());
  return both;
}

class WindingOnDevice : public fixtures::DeviceTest {
 protected:
  /// The largest difference from the exact sum, for each accuracy.
  static std::vector<double> worst_errors(const Mesh& mesh, const Points& queries,
                                          const std::vector<double>& accuracies) {
    const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
    std::vector<double> exact;
    for (Index i = 0; i < queries.rows(); ++i) {
      exact.push_back(exact_winding_number(mesh.vertices, mesh.faces, queries.row(i)));
    }
    std::vector<double> worst;
    for (const double accuracy : accuracies) {
      const auto fast = winding_numbers(tree, queries, {accuracy}, device());
      worst.push_back(0);
      for (std::size_t i = 0; i < fast.size(); ++i) {
        worst.back() = std::max(worst.back(), std::abs(fast[i] - exact[i]));
      }
    }
    return worst;
  }
};
ATELIER_ON_EVERY_DEVICE(WindingOnDevice);

TEST_P(WindingOnDevice, ClosedSurface_IsOneInsideZeroOutside) {
  const Mesh mesh = fixtures::torus(60, 40);
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  const Points queries = scattered_points(500, 1.5, 1);
  const auto numbers = winding_numbers(tree, queries, {}, device());
  for (Index i = 0; i < queries.rows(); ++i) {
    const double ring = std::hypot(queries(i, 0), queries(i, 2)) - 1;
    const double distance = std::hypot(ring, queries(i, 1)) - 0.4;
    if (std::abs(distance) > 0.01) {
      EXPECT_NEAR(numbers[i], distance < 0 ? 1 : 0, 1e-2);
    }
  }
}

TEST_P(WindingOnDevice, OpenAndClosedSurfaces_StayBelowErrorBound) {
  const Points queries = scattered_points(300, 1.6, 2);
  for (const Mesh& mesh : {fixtures::sphere(3), fixtures::tube(50, 16), fixtures::grid(28, 28),
                           fixtures::torus(50, 30)}) {
    const auto errors = worst_errors(mesh, queries, {2, WindingOptions{}.accuracy, 100});
    EXPECT_LT(errors[0], 2e-2);
    EXPECT_LT(errors[1], 5e-3);
    EXPECT_LT(errors[2], 1e-10);
  }
}

TEST_P(WindingOnDevice, TriangleSoup_StaysBelowErrorBound) {
  Mesh mesh;
  mesh.vertices = scattered_points(6000, 1, 3);
  for (Index f = 0; f < 2000; ++f) {
    mesh.vertices.row(3 * f + 1) = mesh.vertices.row(3 * f) + 0.1 * mesh.vertices.row(3 * f + 1);
    mesh.vertices.row(3 * f + 2) = mesh.vertices.row(3 * f) + 0.1 * mesh.vertices.row(3 * f + 2);
  }
  mesh.faces.resize(2000, 3);
  for (Index i = 0; i < 6000; ++i) {
    mesh.faces.data()[i] = static_cast<int>(i);
  }
  EXPECT_LT(worst_errors(mesh, scattered_points(300, 1.5, 4), {3})[0], 5e-3);
}

TEST_P(WindingOnDevice, EmptyMesh_IsZero) {
  const WindingTree tree = build_winding_tree(Points(0, 3), Triangles(0, 3));
  EXPECT_EQ(winding_numbers(tree, Points::Zero(2, 3), {}, device()), (std::vector<double>{0, 0}));
  EXPECT_TRUE(winding_numbers(tree, Points(0, 3), {}, device()).empty());
}

TEST_P(WindingOnDevice, OrientedPointsOfSphere_MatchExactWinding) {
  const Mesh mesh = fixtures::sphere(4);
  const Points normals = vertex_normals(mesh.vertices, mesh.faces);
  const Eigen::VectorXd areas = vertex_areas(mesh.vertices, mesh.faces);
  const WindingTree tree = build_winding_tree(mesh.vertices, normals, areas);
  const Points queries = scattered_points(300, 1.5, 5);
  const auto numbers = winding_numbers(tree, queries, {}, device());
  for (Index i = 0; i < queries.rows(); ++i) {
    const double radius = queries.row(i).norm();
    if (std::abs(radius - 1) > 0.15) {
      EXPECT_NEAR(numbers[i], radius < 1 ? 1 : 0, 0.02);
      EXPECT_NEAR(numbers[i], exact_winding_number(mesh.vertices, normals, areas, queries.row(i)),
                  1e-2);
    }
  }
}

TEST(Winding, FlippedSurface_HasNegativeWinding) {
  Mesh mesh = fixtures::sphere(3);
  EXPECT_NEAR(exact_winding_number(mesh.vertices, mesh.faces, {0.1, 0.2, 0.3}), 1, 1e-12);
  EXPECT_NEAR(exact_winding_number(mesh.vertices, mesh.faces, {1.1, 0.2, 0.3}), 0, 1e-12);
  mesh.faces.col(0).swap(mesh.faces.col(1));
  EXPECT_NEAR(exact_winding_number(mesh.vertices, mesh.faces, {0.1, 0.2, 0.3}), -1, 1e-12);
  EXPECT_NEAR(winding_number(build_winding_tree(mesh.vertices, mesh.faces), {0.1, 0.2, 0.3}), -1,
              1e-2);
}

TEST(Winding, OverlappingSpheres_AddUp) {
  Mesh shifted = fixtures::sphere(4);
  shifted.vertices.col(0).array() += 0.5;
  const Mesh mesh = join(fixtures::sphere(4), shifted);
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  EXPECT_NEAR(winding_number(tree, {0.25, 0, 0}), 2, 1e-2);
  EXPECT_NEAR(winding_number(tree, {-0.8, 0, 0}), 1, 1e-2);
  EXPECT_NEAR(winding_number(tree, {2, 0, 0}), 0, 1e-2);
}

TEST(Winding, HemisphereCentre_IsOneHalf) {
  Mesh mesh = fixtures::sphere(4);
  std::vector<int> upper;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const double y = mesh.vertices(mesh.faces(f, 0), 1) + mesh.vertices(mesh.faces(f, 1), 1) +
                     mesh.vertices(mesh.faces(f, 2), 1);
    if (y > 0) {
      upper.push_back(static_cast<int>(f));
    }
  }
  const Triangles faces = mesh.faces(upper, Eigen::all);
  EXPECT_NEAR(exact_winding_number(mesh.vertices, faces, {0, 0, 0}), 0.5, 1e-9);
  EXPECT_NEAR(winding_number(build_winding_tree(mesh.vertices, faces), {0, 0, 0}), 0.5, 1e-2);
}

TEST(Winding, CrossingTheSurface_JumpsByOne) {
  const Mesh mesh = fixtures::grid(20, 20);  // open
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  const double above = winding_number(tree, {0.43, 1e-7, 0.57});
  const double below = winding_number(tree, {0.43, -1e-7, 0.57});
  EXPECT_NEAR(below - above, 1, 2e-2);
}

TEST(Winding, QueryOnSurface_IsFinite) {
  const Mesh mesh = fixtures::sphere(2);
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double number = winding_number(tree, mesh.vertices.row(v));
    EXPECT_GT(number, -0.01);
    EXPECT_LT(number, 1.01);
  }
  const WindingTree points =
      build_winding_tree(Points::Zero(1, 3), Points::Ones(1, 3), Eigen::VectorXd::Ones(1));
  EXPECT_EQ(winding_number(points, {0, 0, 0}), 0);
}

TEST(Winding, DegenerateFaces_ContributeNothing) {
  const Points vertices = scattered_points(30, 1, 7);
  Triangles faces(10, 3);
  for (int f = 0; f < 10; ++f) {
    faces.row(f) << 3 * f, 3 * f, 3 * f + 1;
  }
  const WindingTree tree = build_winding_tree(vertices, faces);
  EXPECT_NEAR(winding_number(tree, {0.1, 0.2, 0.3}), 0, 1e-15);
}

TEST(WindingMoments, FarField_ConvergesAtThirdOrder) {
  // Twice as far, the error of an expansion of order 2 relative to the value falls by 2^3.
  const Vec3d a = {0.1, 0, 0};
  const Vec3d b = {0, 0.12, 0.02};
  const Vec3d c = {-0.03, 0.01, 0.1};
  const WindingMoments<double> moments = triangle_moments(a, b, c);
  const auto error = [&](double distance) {
    const Vec3d query = distance * Vec3d{0.6, 0.3, -0.5};
    return std::abs(far_solid_angle(moments, query) / solid_angle(query, a, b, c) - 1);
  };
  EXPECT_LT(error(2) / error(1), 0.16);
  EXPECT_LT(error(4) / error(2), 0.16);
}

TEST(WindingMoments, Moments_AreIndependentOfMergeOrder) {
  const Mesh mesh = fixtures::tetrahedron();
  const auto of = [&](Index f) {
    const auto at = [&](int k) {
      const auto row = mesh.vertices.row(mesh.faces(f, k));
      return Vec3d{row[0], row[1], row[2]};
    };
    return triangle_moments(at(0), at(1), at(2));
  };
  WindingMoments<double> flat{};
  flat.center = {0.3, -0.2, 0.1};
  for (Index f = 0; f < 4; ++f) {
    add_moments(flat, of(f));
  }
  WindingMoments<double> pair{};
  pair.center = {0.5, 0.5, 0};
  add_moments(pair, of(0));
  add_moments(pair, of(1));
  WindingMoments<double> nested{};
  nested.center = flat.center;
  add_moments(nested, pair);
  add_moments(nested, of(2));
  add_moments(nested, of(3));
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(nested.first[i], flat.first[i], 1e-13);
  }
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(nested.second[i], flat.second[i], 1e-13);
  }
  EXPECT_NEAR(nested.area, flat.area, 1e-13);
}

constexpr double kWindingNumberNan = std::numeric_limits<double>::quiet_NaN();

TEST(WindingRefuses, NonFiniteVertex_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  Points broken = mesh.vertices;
  broken(3, 1) = kWindingNumberNan;
  ATELIER_EXPECT_REFUSED(build_winding_tree(broken, mesh.faces), LogicError, "finite coordinates");
}

TEST(WindingRefuses, FaceIndexOutOfRange_Throws) {
  Mesh mesh = fixtures::sphere(1);
  mesh.faces(0, 0) = 1000;
  ATELIER_EXPECT_REFUSED(build_winding_tree(mesh.vertices, mesh.faces), LogicError,
                         "a vertex that is not there");
  ATELIER_EXPECT_REFUSED(exact_winding_number(mesh.vertices, mesh.faces, {0, 0, 0}), LogicError,
                         "a vertex that is not there");
}

TEST(WindingRefuses, NonFiniteQuery_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  ATELIER_EXPECT_REFUSED(winding_number(tree, {kWindingNumberNan, 0, 0}), LogicError,
                         "a query must be finite");
  ATELIER_EXPECT_REFUSED(winding_numbers(tree, Points::Constant(1, 3, kWindingNumberNan)),
                         LogicError, "a query must be finite");
  ATELIER_EXPECT_REFUSED(exact_winding_number(mesh.vertices, mesh.faces, {0, kWindingNumberNan, 0}),
                         LogicError, "a query must be finite");
}

TEST(WindingRefuses, AccuracyOutOfRange_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  const WindingTree tree = build_winding_tree(mesh.vertices, mesh.faces);
  for (const double bad : {0.5, 101.0, kWindingNumberNan}) {
    ATELIER_EXPECT_REFUSED(winding_number(tree, {0, 0, 0}, {bad}), LogicError, "1..100");
    ATELIER_EXPECT_REFUSED(winding_numbers(tree, mesh.vertices, {bad}), LogicError, "1..100");
  }
}

TEST(WindingRefuses, OrientedPointCountMismatch_Throws) {
  const Points points = fixtures::sphere(1).vertices;
  const Eigen::VectorXd areas = Eigen::VectorXd::Ones(points.rows());
  const Eigen::VectorXd few = Eigen::VectorXd::Ones(3);
  ATELIER_EXPECT_REFUSED(build_winding_tree(points, points.topRows(3), areas), LogicError,
                         "as many");
  ATELIER_EXPECT_REFUSED(build_winding_tree(points, points, few), LogicError, "as many");
  ATELIER_EXPECT_REFUSED(exact_winding_number(points, points, few, {0, 0, 0}), LogicError,
                         "as many");
}

TEST(WindingRefuses, NonFiniteNormalsOrAreas_Throw) {
  const Points points = fixtures::sphere(1).vertices;
  const Eigen::VectorXd areas = Eigen::VectorXd::Ones(points.rows());
  ATELIER_EXPECT_REFUSED(build_winding_tree(points, points * kWindingNumberNan, areas), LogicError,
                         "normals and areas must be finite");
  ATELIER_EXPECT_REFUSED(build_winding_tree(points, points, areas * kWindingNumberNan), LogicError,
                         "normals and areas must be finite");
}

}  // namespace
}  // namespace atelier
