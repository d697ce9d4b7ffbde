#include "registration/tracking/cloth_energy.h"

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/tracking/body_driven_prediction.h"
#include "tests/support/finite_differences.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

Points noise(Index rows, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-size, size);
  return Points::NullaryExpr(rows, 3, [&] { return uniform(random); });
}

Points points_of(const Eigen::VectorXd& flat) {
  return Eigen::Map<const Points>(flat.data(), flat.size() / 3, 3);
}

Eigen::VectorXd flat_of(const Points& points) {
  return Eigen::Map<const Eigen::VectorXd>(points.data(), points.size());
}

/// A patch, a shape of it, and terms of which `which` alone are there: 0 lengths, 1 bending,
/// 2 edges' vectors, 3 anchors, 4 rows, 5 saturating rows, 6 images; 7: all.
struct Case {
  ClothModel model;
  ClothTerms terms;
  Points x;
};

Case make_case(int which) {
  Case made;
  const Mesh mesh = fixtures::grid(3, 2);
  made.model = cloth_model(mesh.vertices, mesh.faces);
  made.x = mesh.vertices + noise(mesh.vertices.rows(), 0.15, 1);
  const Index edges = made.model.topology.edges.rows();
  const Index vertices = mesh.vertices.rows();
  const bool all = which == 7;
  if (which == 0 || all) {
    made.terms.stretch = 2;
    made.terms.compress = 0.5;
  }
  if (which == 1 || all) {
    made.terms.bend = 0.3;
  }
  if (which == 2 || all) {
    made.terms.edge_weights = noise(edges, 1, 2).col(0).cwiseAbs();
    made.terms.edge_vectors = noise(edges, 0.5, 3);
  }
  if (which == 3 || all) {
    made.terms.anchor_weights = noise(vertices, 1, 4).col(0).cwiseAbs();
    made.terms.anchors = noise(vertices, 1, 5);
  }
  if (which == 4 || which == 5 || all) {
    for (int f = 0; f < mesh.faces.rows(); ++f) {
      SurfaceRow row;
      row.vertices = {mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)};
      row.barycentric = Eigen::Vector3d(0.2, 0.3, 0.5);
      row.normal = noise(1, 1, 10 + static_cast<unsigned>(f)).row(0).normalized().transpose();
      row.offset = 0.1;
      row.weight = 0.7;
      row.scale = which == 4 ? 0 : 0.2;
      made.terms.rows.push_back(row);
    }
    SurfaceRow single;
    single.vertices = {1, 1, 1};
    single.normal = Eigen::Vector3d::UnitY();
    single.weight = 0.4;
    made.terms.rows.push_back(single);
  }
  if (which == 6 || all) {
    made.terms.origin = mesh.vertices;
    for (const int f : {0, 4}) {
      FaceQuadratic q;
      q.face = f;
      const Eigen::Matrix<double, 9, 9> half = Eigen::Matrix<double, 9, 9>::NullaryExpr(
          [&](Index i, Index j) { return std::sin(static_cast<double>(3 * i + j + f)); });
      q.H = half.transpose() * half;
      q.g = half.col(0);
      made.terms.quadratics.push_back(q);
    }
  }
  return made;
}

class ClothEnergyOf : public ::testing::TestWithParam<int> {};

TEST_P(ClothEnergyOf, EnergyGradient_MatchesFiniteDifferences) {
  const Case made = make_case(GetParam());
  const Eigen::VectorXd x = flat_of(made.x);
  const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
      [&](const Eigen::VectorXd& at) {
        return Eigen::VectorXd::Constant(1, cloth_energy(made.model, made.terms, points_of(at)));
      },
      x);
  const Eigen::VectorXd analytic = flat_of(cloth_energy_gradient(made.model, made.terms, made.x));
  EXPECT_LT(fixtures::jacobian_error(analytic.transpose(), numeric), 1e-6);
}

TEST_P(ClothEnergyOf, QuadraticTerms_HaveHalfTheHessianAsMatrix) {
  if (GetParam() == 0 || GetParam() == 5 || GetParam() == 7) {
    return;  // Gauss-Newton leaves out the rest; below
  }
  const Case made = make_case(GetParam());
  ShapeSolver solver(made.model);
  const Eigen::MatrixXd lower = solver.matrix(made.terms, made.x);
  const Eigen::MatrixXd full = lower.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
      [&](const Eigen::VectorXd& at) {
        return flat_of(cloth_energy_gradient(made.model, made.terms, points_of(at)));
      },
      flat_of(made.x));
  EXPECT_LT(fixtures::jacobian_error(2 * full, numeric), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Terms, ClothEnergyOf, ::testing::Range(0, 8));

TEST(ClothEnergy, StretchedEdges_HaveTheHessianAsMatrix) {
  Case made = make_case(0);
  made.x = 1.5 * fixtures::grid(3, 2).vertices + noise(12, 0.02, 8);  // every edge is too long
  made.terms.compress = made.terms.stretch;
  ShapeSolver solver(made.model);
  const Eigen::MatrixXd full =
      Eigen::MatrixXd(solver.matrix(made.terms, made.x)).selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
      [&](const Eigen::VectorXd& at) {
        return flat_of(cloth_energy_gradient(made.model, made.terms, points_of(at)));
      },
      flat_of(made.x));
  EXPECT_LT(fixtures::jacobian_error(2 * full, numeric), 1e-5);
}

TEST(ClothEnergy, RotatedRestShape_HasNoEnergy) {
  const Mesh mesh = fixtures::grid(4, 4);
  const ClothModel model = cloth_model(mesh.vertices, mesh.faces);
  ClothTerms terms;
  terms.stretch = terms.compress = terms.bend = 1;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Points turned = mesh.vertices * turn.transpose();
  EXPECT_NEAR(cloth_energy(model, terms, turned), 0, 1e-20);
}

TEST(ClothEnergy, Cylinder_BendsByItsCurvature) {
  // A sheet rolled to radius r: the integral of the squared curvature is area / r^2.
  const int n = 40;
  Mesh mesh = fixtures::grid(n, n);
  const ClothModel model = cloth_model(mesh.vertices, mesh.faces);
  const double r = 2;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double u = mesh.vertices(v, 0) / r;
    mesh.vertices.row(v) << r * std::sin(u), r * std::cos(u), mesh.vertices(v, 2);
  }
  ClothTerms terms;
  terms.bend = 1;
  EXPECT_NEAR(cloth_energy(model, terms, mesh.vertices), 1 / (r * r), 0.1 / (r * r));
}

TEST(ShapeSolver, QuadraticEnergy_IsMinimized) {
  Case made = make_case(7);
  made.terms.stretch = made.terms.compress = 0;
  for (SurfaceRow& row : made.terms.rows) {
    row.scale = 0;
  }
  ShapeSolver solver(made.model);
  const double before = cloth_energy_gradient(made.model, made.terms, made.x).norm();
  Points x = solver.lower(made.terms, made.x);
  EXPECT_LT(cloth_energy_gradient(made.model, made.terms, x).norm(), 1e-2 * before);
  for (int i = 0; i < 5; ++i) {
    x = solver.lower(made.terms, x);
  }
  EXPECT_LT(cloth_energy_gradient(made.model, made.terms, x).norm(), 1e-6 * before);
}

TEST(ShapeSolver, NoForces_MoveNothing) {
  const Mesh mesh = fixtures::grid(2, 2);
  const ClothModel model = cloth_model(mesh.vertices, mesh.faces);
  ShapeSolver solver(model);
  EXPECT_EQ(solver.lower({}, mesh.vertices), mesh.vertices);
}

TEST(ShapeSolver, EnergyWithoutMinimum_IsRefused) {
  const Mesh mesh = fixtures::grid(2, 2);
  ClothModel model = cloth_model(mesh.vertices, mesh.faces);
  ShapeSolver solver(model);
  ClothTerms terms;
  terms.anchors = Points::Constant(mesh.vertices.rows(), 3, std::nan(""));
  terms.anchor_weights = Eigen::VectorXd::Ones(mesh.vertices.rows());
  ATELIER_EXPECT_REFUSED(solver.lower(terms, mesh.vertices), LogicError, "a number");
  model.lengths[3] = 0;
  ATELIER_EXPECT_REFUSED(ShapeSolver(model), LogicError, "longer than nothing");
}

TEST(ClothModel, DefectiveMeshes_AreRefused) {
  const Mesh mesh = fixtures::grid(2, 2);
  ATELIER_EXPECT_REFUSED(cloth_model(mesh.vertices, Triangles(0, 3)), DataError, "none");
  Triangles three = mesh.faces;
  three.conservativeResize(three.rows() + 1, 3);
  three.row(three.rows() - 1) << 1, 3, 8;  // a third face at the edge of 1 and 3
  ATELIER_EXPECT_REFUSED(cloth_model(mesh.vertices, three, "tee.h5"), DataError, "tee.h5");
  Points loose = mesh.vertices;
  loose.conservativeResize(loose.rows() + 1, 3);
  loose.row(loose.rows() - 1) << 5, 5, 5;
  ATELIER_EXPECT_REFUSED(cloth_model(loose, mesh.faces), DataError, "loose vertices");
  Points flat = mesh.vertices;
  flat.row(0) = flat.row(1);
  flat.row(3) = flat.row(1);
  ATELIER_EXPECT_REFUSED(cloth_model(flat, mesh.faces), DataError, "no area");
}

TEST(BodyDrivenPrediction, RigidBodyMotion_CarriesClothAlong) {
  const Mesh body = fixtures::sphere(2);
  const Mesh cloth = fixtures::grid(3, 3);
  const Points above = cloth.vertices.rowwise() + Eigen::RowVector3d(-0.5, 1.2, -0.5);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.5, Eigen::Vector3d(0, 1, 1).normalized()).toRotationMatrix();
  const Eigen::RowVector3d shift(0.1, 0.2, 0.3);
  const Points moved = (body.vertices * turn.transpose()).rowwise() + shift;
  const BodyDrivenCloth driven = body_driven(above, body.faces, body.vertices, moved);
  const Points expected = (above * turn.transpose()).rowwise() + shift;
  EXPECT_LT((driven.vertices - expected).cwiseAbs().maxCoeff(), 1e-9);
  const ClothModel model = cloth_model(cloth.vertices, cloth.faces);
  ShapeSolver solver(model);
  const Points predicted = predicted_cloth(solver, model, {above, driven, {}, Points(0, 3)});
  EXPECT_LT((predicted - expected).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(BodyDrivenPrediction, OtherTopology_IsRefused) {
  const Mesh body = fixtures::sphere(1);
  ATELIER_EXPECT_REFUSED(body_driven(body.vertices, body.faces, body.vertices, Points::Zero(3, 3)),
                         LogicError, "different topologies");
}

}  // namespace
}  // namespace atelier
