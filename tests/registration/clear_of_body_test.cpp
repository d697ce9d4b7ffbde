#include "registration/tracking/clear_of_body.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/tracking/register_garment.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

/// A tube of cloth, radius 0.15 m, from 0.8 to 1.3 m, and a ball whose side reaches through it.
struct Poked {
  Mesh tube = fixtures::cloth_tube(48, 28);
  ClothModel model = cloth_model(tube.vertices, tube.faces);
  BodyObstacle body;

  explicit Poked(double center = 0.09, double radius = 0.08) {
    Mesh ball = fixtures::sphere(3);
    ball.vertices = (radius * ball.vertices).rowwise() + Eigen::RowVector3d(center, 1.05, 0);
    body = body_obstacle(ball.vertices, ball.faces);
  }
};

TEST(BodyContact, PenetratingCloth_HasItsShareAndDepth) {
  // Seen from the ball's middle: the cloth is nearest where the vertices at 1.05 m are.
  const Poked poked;
  const BodyContact contact = body_contact(poked.tube.vertices, poked.tube.faces, poked.body);
  Index inside = 0;
  double deepest = 0;
  const auto look = [&](const Eigen::RowVector3d& point) {
    const double depth = 0.08 - (point - Eigen::RowVector3d(0.09, 1.05, 0)).norm();
    inside += depth > 0 ? 1 : 0;
    deepest = std::max(deepest, depth);
  };
  for (const auto& vertex : poked.tube.vertices.rowwise()) {
    look(vertex);
  }
  for (const auto& face : poked.tube.faces.rowwise()) {
    look(poked.tube.vertices(face, Eigen::all).colwise().mean());
  }
  const auto asked = static_cast<double>(poked.tube.vertices.rows() + poked.tube.faces.rows());
  EXPECT_NEAR(contact.inside * asked, static_cast<double>(inside), 0.2 * inside);
  EXPECT_NEAR(contact.depth, deepest, 0.001);
  EXPECT_GT(contact.crossings, 10);
}

TEST(BodyContact, NoBodyOrDistantBody_GivesNoContact) {
  const Poked far(1.0);
  for (const BodyObstacle& body : {BodyObstacle(), far.body}) {
    const BodyContact contact = body_contact(far.tube.vertices, far.tube.faces, body);
    EXPECT_EQ(contact.inside, 0);
    EXPECT_EQ(contact.depth, 0);
    EXPECT_EQ(contact.crossings, 0);
  }
}

TEST(BodyContactRefused, NonFiniteCloth_IsRefused) {
  Poked poked;
  poked.tube.vertices(3, 1) = std::numeric_limits<double>::infinity();
  ATELIER_EXPECT_REFUSED(body_contact(poked.tube.vertices, poked.tube.faces, poked.body),
                         LogicError, "finite");
  poked.tube.vertices(3, 1) = 300;
  ATELIER_EXPECT_REFUSED(body_contact(poked.tube.vertices, poked.tube.faces, poked.body),
                         LogicError, "256");
}

TEST(ClearOfBody, ClothPiercedByTheBody_IsMovedAround) {
  const Poked poked;
  ShapeSolver solver(poked.model);
  const Points x = clear_of_body(solver, poked.model, poked.tube.vertices, poked.body, 0.002);
  const BodyContact contact = body_contact(x, poked.tube.faces, poked.body);
  EXPECT_EQ(contact.inside, 0);
  EXPECT_EQ(contact.crossings, 0);
  EXPECT_TRUE(inverted_faces(poked.model.topology, x).empty());
  for (Index v = 0; v < x.rows(); ++v) {
    if (poked.tube.vertices(v, 0) < 0) {  // the far side
      EXPECT_LT((x.row(v) - poked.tube.vertices.row(v)).norm(), 0.001);
    }
  }
}

// Between vertices the body rises through the cloth, which its vertices do not know.
TEST(ClearOfBody, TriangleCentres_AreKeptOutsideToo) {
  const Poked poked(0.0, 0.149);
  Mesh coarse = fixtures::cloth_tube(8, 3);
  const ClothModel model = cloth_model(coarse.vertices, coarse.faces);
  ASSERT_GT(body_contact(coarse.vertices, coarse.faces, poked.body).inside, 0);
  ShapeSolver solver(model);
  const Points x = clear_of_body(solver, model, coarse.vertices, poked.body, 0.002);
  EXPECT_EQ(body_contact(x, coarse.faces, poked.body).inside, 0);
}

TEST(ClearOfBody, ClothClearOfTheBody_StaysInPlace) {
  const Poked far(1.0);
  ShapeSolver solver(far.model);
  EXPECT_EQ(clear_of_body(solver, far.model, far.tube.vertices, far.body, 0.002),
            far.tube.vertices);
  EXPECT_EQ(clear_of_body(solver, far.model, far.tube.vertices, {}, 0.002), far.tube.vertices);
}

TEST(ClearOfBody, InvertedFaces_AreRepairedWithoutABodyToo) {
  const Poked far(1.0);
  Points x = far.tube.vertices;
  x.row(48 * 14) += Eigen::RowVector3d(0, 0.03, 0);
  ASSERT_FALSE(inverted_faces(far.model.topology, x).empty());
  ShapeSolver solver(far.model);
  EXPECT_EQ(clear_of_body(solver, far.model, x, {}, 0.002), turned_back(far.model.topology, x));
}

}  // namespace
}  // namespace atelier
