// Gains of cameras round a textured ball, from the images alone: stereo, samples, least squares.
#include "capture/surface/color_samples.h"

#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/capture_stereo/textured_ball.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

/// Views of the ball with a gain for each camera and channel.
std::vector<InstantView> views_with_gains(std::vector<Eigen::Vector3d>& gains) {
  const TexturedBall ball;
  Random random{5, 1};
  std::vector<InstantView> views;
  for (const StereoView& stereo : ball.views(14, 0.448798951, 120, 120)) {
    Eigen::Vector3d gain;
    for (int c = 0; c < 3; ++c) {
      gain[c] = std::exp(0.1 * normal(random));
    }
    gains.push_back(gain);
    InstantView view;
    view.camera = stereo.camera;
    view.camera.id = "cam" + std::to_string(views.size());
    view.image = Image(120, 120, 3);
    view.mask = ByteImage(120, 120, 1);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 120; ++x) {
        const float value = std::pow(std::max(stereo.image.at(x, y), 0.0F), 2.2F);
        for (int c = 0; c < 3; ++c) {
          view.image.at(x, y, c) = value * static_cast<float>(gain[c]) * (1.0F - 0.2F * c);
        }
        view.mask.at(x, y) = ball.depth(stereo.camera, x + 0.5, y + 0.5) ? 255 : 0;
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

ReconstructOptions quick_options() {
  ReconstructOptions options;
  options.stereo.iterations = 3;
  options.stereo.refinements = 1;
  options.surface.octree_depth = 6;
  options.surface.edge_length = 0.02;
  return options;
}

TEST(ColorSamples, CamerasAroundABall_GiveTheirGains) {
  std::vector<Eigen::Vector3d> truth;
  const std::vector<InstantView> views = views_with_gains(truth);
  const auto samples = color_samples(views, quick_options());
  EXPECT_GT(samples.size(), 2000U);
  const ColorGains found = color_gains(static_cast<int>(views.size()), samples);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& gain : truth) {
    mean += gain.array().log().matrix() / static_cast<double>(truth.size());
  }
  double worst = 0;
  double sum = 0;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const Eigen::Array3d wanted = (truth[c].array().log() - mean.array()).exp();
    const Eigen::Array3d error = (found.gain[c].array() / wanted - 1).abs();
    worst = std::max(worst, error.maxCoeff());
    sum += error.mean() / static_cast<double>(truth.size());
  }
  std::printf("14 cameras, gains spread by 10%%: mean error %.2f%%, largest %.2f%%\n", 100 * sum,
              100 * worst);
  EXPECT_LT(sum, 0.01);
  EXPECT_LT(worst, 0.03);
}

TEST(ColorSamples, EmptyMasks_AreRefused) {
  std::vector<Eigen::Vector3d> truth;
  std::vector<InstantView> views = views_with_gains(truth);
  for (InstantView& view : views) {
    view.mask = ByteImage(120, 120, 1);
  }
  ATELIER_EXPECT_REFUSED(color_samples(views, quick_options()), DataError, "at least two");
}

}  // namespace
}  // namespace atelier::fixtures
