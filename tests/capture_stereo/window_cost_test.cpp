#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "capture/stereo/stereo_math.h"

namespace atelier {
namespace {

/// What a faint pattern costs that a source sees at the same pixels, with more light by a gloss.
/// @param value  gamma-coded, of the pattern's mean
/// @param gloss  linear
float cost_with_gloss(float value, float gloss) {
  constexpr int kSide = 16;
  std::vector<float> reference;
  std::vector<float> source;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float seen = value + 0.01F * std::sin(1.3F * static_cast<float>(x)) *
                                     std::cos(1.1F * static_cast<float>(y));
      reference.push_back(seen);
      source.push_back(std::pow(std::pow(seen, 2.2F) + gloss, 1 / 2.2F));
    }
  }
  const std::vector<float> near(reference.size(), 1.0F);
  StereoProblem problem{};
  problem.fx = problem.fy = 100;
  problem.cx = problem.cy = 0.5F * kSide;
  problem.width = problem.height = kSide;
  problem.image = reference.data();
  problem.near_depth = near.data();
  problem.colour_sigma = 0.1F;
  problem.level_weight = 1;
  problem.sources = 1;
  problem.source[0].forth[0] = problem.source[0].forth[4] = problem.source[0].forth[8] = 1;
  problem.source[0].image = source.data();
  problem.source[0].width = problem.source[0].height = kSide;
  const ReferenceWindow window = window_at(problem, 8, 8);
  return window_cost<ScalarSamples>(problem, window, problem.source[0], 8, 8, {2, {0, 0, -1}});
}

TEST(WindowCost, IdenticalWindows_CostNothing) {
  EXPECT_NEAR(cost_with_gloss(0.6F, 0), 0, 1e-3);
}

// The same light on black cloth is three times the gamma-coded value that it is on skin, and is no
// more a sign of another place.
TEST(WindowCost, GlossOnDarkCloth_CostsAsOnSkin) {
  for (const float gloss : {0.005F, 0.01F}) {
    const float skin = cost_with_gloss(0.6F, gloss);
    EXPECT_GT(skin, 0.1F);
    EXPECT_LT(cost_with_gloss(0.2F, gloss), 1.5F * skin) << gloss;
    EXPECT_LT(cost_with_gloss(0.8F, gloss), skin + 0.01F) << gloss;
  }
}

}  // namespace
}  // namespace atelier
