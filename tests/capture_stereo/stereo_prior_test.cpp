#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "capture/stereo/stereo_prior_math.h"

namespace atelier::fixtures {
namespace {

/// Beliefs of a small view, every pixel sure of one plane.
struct PlaneView {
  int width = 40;
  int height = 32;
  StereoPlane plane;
  StereoProblem problem{};
  std::vector<float> looked = std::vector<float>(static_cast<std::size_t>(width) * height, 1.0f);
  std::vector<StereoPlane> planes;
  std::vector<float> costs = std::vector<float>(looked.size(), 0.1f);

  explicit PlaneView(Vec3f normal = {0.3f, -0.2f, -0.93f}) {
    plane = {2.0f, (1 / norm(normal)) * normal};
    problem.fx = problem.fy = 50;
    problem.cx = 20;
    problem.cy = 16;
    problem.width = width;
    problem.height = height;
    problem.near_depth = looked.data();
    problem.sources = 1;
    problem.source[0].parallax = 20;
    problem.prior_weight = 0.1f;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        planes.push_back(at(x, y));
      }
    }
  }
  StereoPlane at(int x, int y) const {
    return {plane_depth(plane, pixel_ray(problem, 20, 16), pixel_ray(problem, x, y)), plane.normal};
  }
  Vec3f predicted(int column, int row) const {
    std::vector<PriorMoments> moments;
    for (int r = 0; r < prior_cells(height); ++r) {
      for (int c = 0; c < prior_cells(width); ++c) {
        moments.push_back(cell_moments(problem, planes.data(), costs.data(), c, r));
      }
    }
    return predicted_plane(problem, moments.data(), column, row);
  }
};

TEST(StereoPrior, Plane_IsPredictedIntoUncertainHole) {
  PlaneView view;
  for (int y = 12; y < 20; ++y) {
    for (int x = 16; x < 24; ++x) {  // a hole of 2 x 2 cells
      const auto p = static_cast<std::size_t>(y * view.width + x);
      view.costs[p] = 1.2f;
      view.planes[p].depth = 0.5f;
    }
  }
  const std::vector<Vec3f> prior(
      static_cast<std::size_t>(prior_cells(view.width)) * prior_cells(view.height),
      view.predicted(4, 3));
  view.problem.prior = prior.data();
  const StereoPlane found = predicted_at(view.problem, pixel_ray(view.problem, 18, 14), 18, 14);
  EXPECT_NEAR(found.depth, view.at(18, 14).depth, 1e-5);
  EXPECT_NEAR(dot(found.normal, view.plane.normal), 1, 1e-6);
  EXPECT_LT(dot(found.normal, pixel_ray(view.problem, 18, 14)), 0);
}

TEST(StereoPrior, TooFewSurePixels_PredictNothing) {
  PlaneView view;
  std::fill(view.costs.begin(), view.costs.end(), 1.2f);
  EXPECT_EQ(dot(view.predicted(4, 3), {1, 1, 1}), 0);
  for (int y = 0; y < view.height; ++y) {  // a line tells no slope
    view.costs[static_cast<std::size_t>(y * view.width + 18)] = 0.1f;
  }
  EXPECT_EQ(dot(view.predicted(4, 3), {1, 1, 1}), 0);
}

TEST(StereoPrior, DepthEdge_IsNotPredictedAcross) {
  PlaneView view;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 18; x < view.width; ++x) {
      view.planes[static_cast<std::size_t>(y * view.width + x)].depth *= 1.2f;
    }
  }
  EXPECT_EQ(dot(view.predicted(4, 3), {1, 1, 1}), 0);
  EXPECT_GT(norm(view.predicted(1, 3)), 0);
  EXPECT_GT(norm(view.predicted(8, 3)), 0);
}

TEST(StereoPrior, Penalty_GrowsWithDistanceAndIsBounded) {
  const PlaneView view;
  const StereoPlane here = view.at(18, 14);
  EXPECT_NEAR(prior_doubt(view.problem, here, here), 0, 1e-6);
  float last = 0;
  for (const float shift : {0.2f, 0.5f, 1.0f, 3.0f}) {  // px of disparity
    StereoPlane off = here;
    off.depth = 1 / (1 / here.depth + shift / 20);
    const float doubt = prior_doubt(view.problem, here, off);
    EXPECT_GT(doubt, last);
    last = doubt;
  }
  EXPECT_NEAR(last, 0.1f, 1e-4);
  EXPECT_EQ(prior_doubt(view.problem, {0, here.normal}, here), 0);  // nothing is predicted
}

TEST(StereoPrior, CellsBeyondTheImage_AreEmpty) {
  const PlaneView view;
  EXPECT_EQ(cell_moments(view.problem, view.planes.data(), view.costs.data(), 9, 7).count, 16);
  EXPECT_EQ(cell_moments(view.problem, view.planes.data(), view.costs.data(), 10, 7).count, 0);
  EXPECT_EQ(prior_cells(41), 11);
}

}  // namespace
}  // namespace atelier::fixtures
