#include "registration/tracking/body_driven_prediction.h"

#include <Eigen/Geometry>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace atelier {
namespace {

TEST(EdgeRotations, TurnedSheet_TurnsAsItDid) {
  const Mesh sheet =
      fixtures::grid(6, 5);  // flat: edges around a vertex say nothing of a third axis
  const Topology topology = topology_of(sheet.faces, sheet.vertices.rows());
  const Eigen::VectorXd weights = Eigen::VectorXd::Ones(topology.edges.rows());
  for (const double angle : {0.0, 0.4, 1.9, std::numbers::pi}) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(angle, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    const Points turned = sheet.vertices * turn.transpose();
    for (const Eigen::Matrix3d& own :
         edge_rotations(topology.edges, weights, sheet.vertices, turned)) {
      EXPECT_LT((own - turn).norm(), 1e-7);
      EXPECT_NEAR(own.determinant(), 1, 1e-12);
    }
  }
  // All in one place, or along one line: no rotation is told.
  const Points line = sheet.vertices.col(0) * Eigen::RowVector3d(1, 0, 0);
  for (const Points& flat : {Points(Points::Zero(line.rows(), 3)), line}) {
    for (const Eigen::Matrix3d& own : edge_rotations(topology.edges, weights, flat, flat)) {
      EXPECT_TRUE(own.isIdentity(1e-9));
    }
  }
}

}  // namespace
}  // namespace atelier
