#include "bodymodel/underlying/vertex_energy.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/topology.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/support/finite_differences.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::random_points;

/// Every kind of term on a small sphere.
VertexEnergy every_term(const Mesh& mesh, bool saturating = true) {
  Random random{3};
  VertexEnergy energy;
  energy.edges = topology_of(mesh.faces, mesh.vertices.rows()).edges;
  energy.edge_weights = Eigen::VectorXd::Constant(energy.edges.rows(), 0.7);
  energy.edge_vectors = random_points(random, energy.edges.rows(), 0.2);
  energy.anchors = random_points(random, mesh.vertices.rows(), 1);
  energy.anchor_weights = Eigen::VectorXd::Constant(mesh.vertices.rows(), 0.3);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    PlaneRow row;
    row.vertices = {mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)};
    row.barycentric = {0.2, 0.3, 0.5};
    row.normal = random_points(random, 1, 1).row(0).normalized().transpose();
    row.offset = uniform(random, -1, 1);
    row.weight = uniform(random, 0.5, 2);
    row.scale = saturating && f % 2 == 0 ? 0.5 : 0;
    energy.rows.push_back(row);
  }
  return energy;
}

Points points_of(const Eigen::VectorXd& x) {
  return Eigen::Map<const Points>(x.data(), x.size() / 3, 3);
}

/// The sum as the header has it.
double vertex_energy(const VertexEnergy& energy, const Points& x) {
  double sum = 0;
  for (Index e = 0; e < energy.edges.rows(); ++e) {
    sum += energy.edge_weights[e] *
           (x.row(energy.edges(e, 0)) - x.row(energy.edges(e, 1)) - energy.edge_vectors.row(e))
               .squaredNorm();
  }
  for (Index v = 0; v < x.rows(); ++v) {
    sum += energy.anchor_weights[v] * (x.row(v) - energy.anchors.row(v)).squaredNorm();
  }
  for (const PlaneRow& row : energy.rows) {
    double r = -row.offset;
    for (int k = 0; k < 3; ++k) {
      r += row.barycentric[k] * x.row(row.vertices[static_cast<std::size_t>(k)]).dot(row.normal);
    }
    sum += row.weight * r * r / (row.scale > 0 ? 1 + r * r / (row.scale * row.scale) : 1);
  }
  return sum;
}

TEST(VertexEnergy, EnergyGradient_MatchesFiniteDifferences) {
  const Mesh mesh = fixtures::sphere(1);
  const VertexEnergy energy = every_term(mesh);
  const Eigen::VectorXd x =
      Eigen::Map<const Eigen::VectorXd>(mesh.vertices.data(), mesh.vertices.size());
  const Points gradient = vertex_energy_gradient(energy, mesh.vertices);
  const Eigen::MatrixXd numeric = fixtures::finite_difference_jacobian(
      [&](const Eigen::VectorXd& at) {
        return Eigen::VectorXd::Constant(1, vertex_energy(energy, points_of(at)));
      },
      x);
  const Eigen::MatrixXd analytic =
      Eigen::Map<const Eigen::RowVectorXd>(gradient.data(), gradient.size());
  EXPECT_LT(fixtures::jacobian_error(analytic, numeric), 1e-7);
}

TEST(VertexEnergy, QuadraticEnergy_IsMinimizedInOneStep) {
  const Mesh mesh = fixtures::sphere(2);
  const VertexEnergy energy = every_term(mesh, false);
  const Points x = lower_vertex_energy(energy, mesh.vertices,
                                       {.steps = 1, .iterations = 500, .tolerance = 1e-12});
  EXPECT_LT(vertex_energy_gradient(energy, x).norm(),
            1e-9 * vertex_energy_gradient(energy, mesh.vertices).norm());
}

TEST(VertexEnergy, RobustRows_DecreaseAndConverge) {
  const Mesh mesh = fixtures::sphere(2);
  const VertexEnergy energy = every_term(mesh);
  Points x = mesh.vertices;
  double last = vertex_energy(energy, x);
  for (int i = 0; i < 5; ++i) {
    x = lower_vertex_energy(energy, x, {.steps = 1, .iterations = 500, .tolerance = 1e-10});
    const double now = vertex_energy(energy, x);
    EXPECT_LE(now, last * (1 + 1e-12));
    last = now;
  }
  x = lower_vertex_energy(energy, x, {.steps = 60, .iterations = 500, .tolerance = 1e-10});
  EXPECT_LT(vertex_energy_gradient(energy, x).norm(), 1e-5);
}

TEST(VertexEnergy, Outlier_PullsLessTheFartherItIs) {
  VertexEnergy energy;
  energy.edges.resize(0, 2);
  energy.edge_vectors.resize(0, 3);
  energy.anchors = Points::Zero(1, 3);
  energy.anchor_weights = Eigen::VectorXd::Ones(1);
  PlaneRow row;
  row.normal = Eigen::Vector3d::UnitX();
  row.weight = 1;
  row.scale = 0.01;
  const auto pulled_to = [&](double place) {
    row.offset = place;
    energy.rows = {row};
    return lower_vertex_energy(energy, energy.anchors, {.steps = 50})(0, 0);
  };
  EXPECT_GT(pulled_to(0.01), 0.002);
  EXPECT_LT(pulled_to(1), 1e-6);
}

TEST(VertexEnergy, MismatchedSizes_AreRefused) {
  const Mesh mesh = fixtures::sphere(0);
  VertexEnergy energy = every_term(mesh);
  energy.anchor_weights.conservativeResize(3);
  ATELIER_EXPECT_REFUSED(vertex_energy_gradient(energy, mesh.vertices), LogicError,
                         "needs an anchor");
  energy = every_term(mesh);
  energy.edge_weights.conservativeResize(1);
  ATELIER_EXPECT_REFUSED(vertex_energy_gradient(energy, mesh.vertices), LogicError,
                         "a weight and a vector");
  energy = every_term(mesh);
  energy.rows[0].vertices[1] = 6;
  ATELIER_EXPECT_REFUSED(lower_vertex_energy(energy, mesh.vertices), LogicError,
                         "a row names a vertex that is not there");
  energy = every_term(mesh);
  energy.edges(0, 0) = -1;
  ATELIER_EXPECT_REFUSED(vertex_energy_gradient(energy, mesh.vertices), LogicError,
                         "an edge names a vertex that is not there");
}

}  // namespace
}  // namespace atelier
