#include "appearance/remove_penetration.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace atelier {
namespace {

/// A tube along y of `rings` rings from 0 to `height`, its radius of the angle; ends closed or not.
template <class Radius>
void tube(int rings, int sectors, double height, const Radius& radius, bool closed, Points& x,
          Triangles& faces) {
  const Index ends = closed ? 2 : 0;
  x.resize(rings * sectors + ends, 3);
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      const double angle = 2 * std::numbers::pi * s / sectors;
      const double y = height * r / (rings - 1);
      x.row(r * sectors + s) << radius(angle, y) * std::cos(angle), y,
          -radius(angle, y) * std::sin(angle);
    }
  }
  faces.resize(2 * (rings - 1) * sectors + (closed ? 2 * sectors : 0), 3);
  Index f = 0;
  for (int r = 0; r + 1 < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      const int a = r * sectors + s;
      const int b = r * sectors + (s + 1) % sectors;
      faces.row(f++) << a, b, b + sectors;
      faces.row(f++) << a, b + sectors, a + sectors;
    }
  }
  if (closed) {
    const int low = rings * sectors;
    const int top = (rings - 1) * sectors;
    x.row(low) << 0, 0, 0;
    x.row(low + 1) << 0, height, 0;
    for (int s = 0; s < sectors; ++s) {
      faces.row(f++) << low, (s + 1) % sectors, s;
      faces.row(f++) << low + 1, top + s, top + (s + 1) % sectors;
    }
  }
}

struct Leg : ::testing::Test {
  Leg() {
    tube(
        41, 48, 0.8, [](double, double) { return 0.1; }, true, skin, faces);
    // Trousers, 1 cm off but for a patch that was registered 1.5 cm into the leg.
    tube(
        33, 40, 0.6, [](double angle, double y) { return in_patch(angle, y) ? 0.085 : 0.11; },
        false, cloth, cloth_faces);
  }
  static bool in_patch(double angle, double y) {
    return angle > 1 && angle < 2 && y > 0.2 && y < 0.4;
  }
  Points skin, cloth;
  Triangles faces, cloth_faces;
};

TEST_F(Leg, SkinOutsideItsCloth_IsMovedInsideAndOtherSkinStays) {
  const Points tucked = remove_penetration(skin, faces, cloth, cloth_faces, 0.03);
  int moved = 0;
  for (Index v = 0; v < skin.rows(); ++v) {
    const double angle = std::atan2(-skin(v, 2), skin(v, 0));
    const double y = skin(v, 1);
    if (angle > 1.2 && angle < 1.8 && y > 0.23 && y < 0.37) {
      EXPECT_LT(std::hypot(tucked(v, 0), tucked(v, 2)), 0.085 - 0.002) << v;
      ++moved;
    } else if (angle < 0.7 || angle > 2.3 || y < 0.15 || y > 0.45) {
      EXPECT_EQ(tucked.row(v), skin.row(v)) << v;
    }
  }
  EXPECT_GT(moved, 20);
  EXPECT_TRUE(remove_penetration(tucked, faces, cloth, cloth_faces, 0.03) == tucked)
      << "once is enough";
}

TEST_F(Leg, ClothDeeperThanTheReach_LeavesTheSkin) {
  const Points tucked = remove_penetration(skin, faces, cloth, cloth_faces, 0.01);
  for (Index v = 0; v < skin.rows(); ++v) {
    const double angle = std::atan2(-skin(v, 2), skin(v, 0));
    if (angle > 1.3 && angle < 1.7 && skin(v, 1) > 0.25 && skin(v, 1) < 0.35) {
      EXPECT_EQ(tucked.row(v), skin.row(v)) << v;
    }
  }
}

TEST_F(Leg, NoCloth_MovesNothing) {
  EXPECT_TRUE(remove_penetration(skin, faces, Points(0, 3), Triangles(0, 3), 0.03) == skin);
}

TEST_F(Leg, HandRestingOnCloth_StaysUnchanged) {
  // 1.5 cm thick, 2 mm off the cloth: under the back of the hand there is cloth within the reach.
  Points hand;
  Triangles hand_faces;
  tube(
      9, 24, 0.08, [](double, double) { return 0.0075; }, true, hand, hand_faces);
  hand.col(0).array() += 0.11 + 0.002 + 0.0075;
  hand.col(1).array() += 0.5;
  EXPECT_TRUE(remove_penetration(hand, hand_faces, cloth, cloth_faces, 0.03) == hand);
}

}  // namespace
}  // namespace atelier
