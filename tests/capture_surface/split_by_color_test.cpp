// Skin and clothing by colour alone, on a painted figure whose parts are known.

#include "capture/surface/split_by_color.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

constexpr std::uint8_t kSkin = 1;
constexpr std::uint8_t kHair = 2;
constexpr std::uint8_t kUpper = 3;
constexpr std::uint8_t kLower = 4;
constexpr std::uint8_t kDress = 5;
constexpr std::uint8_t kShoes = 7;

struct Figure {
  Mesh mesh;
  std::vector<std::uint8_t> truth;
};

/// A column 1.7 m tall: shoes, bare shins, clothing, bare neck and face, hair.
Figure figure(bool dress, std::uint64_t seed, const Eigen::Vector3d& skin = {0.5, 0.3, 0.2}) {
  constexpr int kRings = 120;
  constexpr int kAround = 40;
  Figure figure;
  figure.mesh.vertices.resize(kRings * kAround, 3);
  figure.mesh.colors.resize(kRings * kAround, 3);
  figure.mesh.faces.resize((kRings - 1) * kAround * 2, 3);
  Random random{seed, 1};
  for (int r = 0; r < kRings; ++r) {
    const double h = r / (kRings - 1.0);
    for (int a = 0; a < kAround; ++a) {
      const double angle = 6.283185307 * a / kAround;
      const int v = r * kAround + a;
      figure.mesh.vertices.row(v) << 0.15 * std::cos(angle), 1.7 * h, 0.15 * std::sin(angle);
      const bool back = std::cos(angle) < -0.3;
      std::uint8_t label = kSkin;
      Eigen::Vector3d color = skin;
      if (h < 0.05) {
        label = kShoes;
        color = {0.03, 0.03, 0.03};
      } else if (h > 0.25 && h < 0.84) {
        label = dress ? kDress : h > 0.55 ? kUpper : kLower;
        color =
            dress || h > 0.55 ? Eigen::Vector3d(0.1, 0.2, 0.5) : Eigen::Vector3d(0.15, 0.3, 0.12);
      } else if (h > 0.95 || (h > 0.9 && back)) {
        label = kHair;
        color = {0.06, 0.04, 0.02};
      }
      // Light from one side, and noise.
      color *= 0.75 + 0.25 * std::cos(angle - 1);
      for (int c = 0; c < 3; ++c) {
        figure.mesh.colors(v, c) =
            static_cast<float>(std::max(0.0, color[c] * (1 + 0.05 * normal(random))));
      }
      figure.truth.push_back(label);
      if (r > 0) {
        const int next = r * kAround + (a + 1) % kAround;
        const int f = 2 * ((r - 1) * kAround + a);
        figure.mesh.faces.row(f) << v - kAround, v, next;
        figure.mesh.faces.row(f + 1) << v - kAround, next, next - kAround;
      }
    }
  }
  return figure;
}

double right_share(const Figure& figure, const std::vector<std::uint8_t>& labels) {
  double right = 0;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    right += labels[v] == figure.truth[v] ? 1 : 0;
  }
  return right / static_cast<double>(labels.size());
}

TEST(SplitByColor, PaintedFigures_SplitIntoSkinHairAndClothing) {
  for (const bool dress : {true, false}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      for (const Eigen::Vector3d& skin :
           {Eigen::Vector3d(0.5, 0.3, 0.2), Eigen::Vector3d(0.12, 0.065, 0.04)}) {
        const Figure one = figure(dress, seed, skin);
        const ColorSplit split = split_by_color(one.mesh);
        const double right = right_share(one, split.labels);
        std::printf("%s, seed %d: %.3f of the vertices right\n", dress ? "dress" : "two pieces",
                    static_cast<int>(seed), right);
        // Dark skin, dark hair and dark shoes are not always told apart.
        EXPECT_GT(right, skin.x() > 0.3 ? 0.98 : 0.85);
        ASSERT_FALSE(split.findings.empty());
        EXPECT_EQ(split.findings[0].code, "labels-by-color");
      }
    }
  }
}

TEST(SplitByColor, NoSkin_GivesAFinding) {
  Figure one = figure(true, 1);
  one.mesh.colors.setConstant(0.2F);
  one.mesh.colors.col(2).array() += 0.3F;
  const ColorSplit split = split_by_color(one.mesh);
  ASSERT_EQ(split.findings.size(), 2U);
  EXPECT_EQ(split.findings[1].code, "skin-not-found");
  EXPECT_EQ(std::count(split.labels.begin(), split.labels.end(), kSkin), 0);
}

TEST(SplitByColor, RepeatedSplit_GivesTheSameLabels) {
  const Figure one = figure(false, 5);
  EXPECT_EQ(split_by_color(one.mesh).labels, split_by_color(one.mesh).labels);
}

TEST(SplitByColor, ScanWithoutColorsOrFaces_IsRefused) {
  Figure one = figure(true, 1);
  Mesh grey = one.mesh;
  grey.colors.resize(0, 3);
  ATELIER_EXPECT_REFUSED(split_by_color(grey), LogicError, "a colour for each vertex");
  Mesh points = one.mesh;
  points.faces.resize(0, 3);
  ATELIER_EXPECT_REFUSED(split_by_color(points), LogicError, "a scan with faces");
  Mesh small;
  small.vertices = one.mesh.vertices.topRows(3);
  small.colors = one.mesh.colors.topRows(3);
  small.faces.resize(1, 3);
  small.faces << 0, 1, 2;
  ATELIER_EXPECT_REFUSED(split_by_color(small), DataError, "100 at least");
}

}  // namespace
}  // namespace atelier::fixtures
