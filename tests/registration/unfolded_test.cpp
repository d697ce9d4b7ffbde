#include "registration/tracking/unfolded.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/error.h"
#include "registration/tracking/clear_of_body.h"
#include "registration/tracking/register_garment.h"
#include "tests/registration/registered_shapes.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

/// Two coarse rings side by side, of one cloth, and the same with the first one wound twice round
/// itself, which no smoothing undoes.
struct Wound {
  static constexpr int kAcross = 5;
  Mesh rings = fixtures::torus(6, kAcross);
  Topology topology;
  Points x;
  Index half = rings.vertices.rows();

  Wound() {
    const Mesh one = rings;
    rings.vertices.resize(2 * half, 3);
    rings.vertices << one.vertices, (one.vertices.rowwise() + Eigen::RowVector3d(4, 0, 0));
    rings.faces.resize(2 * one.faces.rows(), 3);
    rings.faces << one.faces, (one.faces.array() + static_cast<int>(half)).matrix();
    topology = topology_of(rings.faces, rings.vertices.rows());
    x = rings.vertices;
    for (Index v = 0; v < half; ++v) {
      x.row(v) = one.vertices.row(v / kAcross * kAcross + 2 * (v % kAcross) % kAcross);
    }
  }
};

TEST(Unfolded, UninvertedCloth_StaysUnchanged) {
  const Wound wound;
  const Unfolded same = unfolded(wound.topology, wound.rings.vertices, {wound.x});
  EXPECT_EQ(same.vertices, wound.rings.vertices);
  EXPECT_EQ(same.given_back, 0);
  EXPECT_EQ(same.still_turned, 0);
}

TEST(Unfolded, InversionsFixedBySmoothing_NeedNoOtherShape) {
  const Wound wound;
  Points x = wound.rings.vertices;
  x.row(7) -= 1.5 * (x.row(7) - x.topRows(wound.half).colwise().mean());
  ASSERT_FALSE(inverted_faces(wound.topology, x).empty());
  const Unfolded smoothed = unfolded(wound.topology, x, {wound.rings.vertices});
  EXPECT_EQ(smoothed.vertices, turned_back(wound.topology, x));
  EXPECT_EQ(smoothed.given_back, 0);
}

TEST(Unfolded, InversionsLeftBySmoothing_TakeAnEarlierShape) {
  const Wound wound;
  ASSERT_FALSE(inverted_faces(wound.topology, turned_back(wound.topology, wound.x)).empty());
  const Unfolded back = unfolded(wound.topology, wound.x, {wound.x, wound.rings.vertices});
  EXPECT_TRUE(inverted_faces(wound.topology, back.vertices).empty());
  EXPECT_EQ(back.still_turned, 0);
  EXPECT_GT(back.given_back, 0);
  EXPECT_LE(back.given_back, wound.half);
  EXPECT_EQ(back.vertices.bottomRows(wound.half), wound.rings.vertices.bottomRows(wound.half));
}

TEST(Unfolded, NoUninvertedShape_ReportsWhatRemains) {
  const Wound wound;
  const Unfolded none = unfolded(wound.topology, wound.x, {});
  EXPECT_EQ(none.vertices, turned_back(wound.topology, wound.x));
  EXPECT_EQ(none.still_turned,
            static_cast<int>(inverted_faces(wound.topology, none.vertices).size()));
  EXPECT_GT(none.still_turned, 0);
  const Unfolded same = unfolded(wound.topology, wound.x, {wound.x});
  EXPECT_EQ(same.vertices, wound.x);
  EXPECT_GT(same.still_turned, 0);
}

// Whatever is asked of it: places by chance, all in one, on one line, inside out, wound.
TEST(Unfolded, AnyStart_EndsWithoutInversions) {
  const Wound wound;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1, 1);
  std::vector<Points> anywhere(6, wound.rings.vertices);
  anywhere.push_back(wound.x);
  for (int i = 0; i < 3; ++i) {
    for (double& coordinate : anywhere[static_cast<std::size_t>(i)].reshaped()) {
      coordinate = place(random);
    }
  }
  anywhere[3].setZero();
  anywhere[4].rightCols(2).setZero();
  anywhere[5].col(0) *= -1;
  for (const Points& x : anywhere) {
    const Unfolded found = unfolded(wound.topology, x, {wound.rings.vertices});
    EXPECT_TRUE(inverted_faces(wound.topology, found.vertices).empty());
    EXPECT_TRUE(found.vertices.allFinite());
  }
}

TEST(UnfoldedRefused, ShapesOfAnotherClothOrNonFinite_AreRefused) {
  const Wound wound;
  ATELIER_EXPECT_REFUSED(unfolded(wound.topology, wound.x, {wound.x.topRows(5)}), LogicError,
                         "another cloth");
  Points nowhere = wound.x;
  nowhere(2, 1) = std::numeric_limits<double>::quiet_NaN();
  ATELIER_EXPECT_REFUSED(unfolded(wound.topology, nowhere, {}), LogicError, "places");
  ATELIER_EXPECT_REFUSED(unfolded(wound.topology, wound.x, {nowhere}), LogicError, "another cloth");
  ATELIER_EXPECT_REFUSED(unfolded(wound.topology, wound.x.topRows(5), {}), LogicError, "places");
}

}  // namespace
}  // namespace atelier
