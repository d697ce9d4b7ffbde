// Gains between cameras from places that several see: exact, noisy, with outliers, refused.

#include "capture/surface/color_gains.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

struct Scene {
  std::vector<Eigen::Vector3d> gain;
  std::vector<ColorSample> samples;
};

/// Places seen by neighbours on a ring of cameras; a share of the samples is something else.
Scene ring(int cameras, int places, double noise, double outliers, std::uint64_t seed) {
  Random random{seed, 1};
  Scene scene;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int c = 0; c < cameras; ++c) {
    Eigen::Vector3d log_gain;
    for (int k = 0; k < 3; ++k) {
      log_gain[k] = 0.2 * normal(random);
    }
    scene.gain.push_back(log_gain);
    mean += log_gain / cameras;
  }
  for (Eigen::Vector3d& gain : scene.gain) {
    gain = (gain - mean).array().exp();
  }
  for (int p = 0; p < places; ++p) {
    const Eigen::Vector3d color(uniform(random, 0.1, 0.4), uniform(random, 0.1, 0.4),
                                uniform(random, 0.1, 0.4));
    const int first = static_cast<int>(uniform_index(random, static_cast<std::uint64_t>(cameras)));
    for (int view = 0; view < 3; ++view) {
      const int c = (first + view) % cameras;
      ColorSample sample{c, p, color, 1};
      for (int k = 0; k < 3; ++k) {
        sample.color[k] *=
            scene.gain[static_cast<std::size_t>(c)][k] * std::exp(noise * normal(random));
      }
      if (uniform(random) < outliers) {
        sample.color *= uniform(random, 0.3, 2);
      }
      scene.samples.push_back(sample);
    }
  }
  return scene;
}

double largest_error(const ColorGains& found, const std::vector<Eigen::Vector3d>& truth) {
  double error = 0;
  for (std::size_t c = 0; c < truth.size(); ++c) {
    error = std::max(error, (found.gain[c].array() / truth[c].array() - 1).abs().maxCoeff());
  }
  return error;
}

TEST(ColorGains, NoiseFreeSamples_GiveExactGains) {
  const Scene scene = ring(8, 2000, 0, 0, 1);
  const ColorGains found = color_gains(8, scene.samples);
  EXPECT_LT(largest_error(found, scene.gain), 1e-6);
  Eigen::Vector3d product = Eigen::Vector3d::Ones();
  for (const Eigen::Vector3d& gain : found.gain) {
    product = product.cwiseProduct(gain);
  }
  EXPECT_LT((product - Eigen::Vector3d::Ones()).norm(), 1e-9);  // the gauge
}

TEST(ColorGains, Outliers_BarelyChangeTheGains) {
  for (const std::uint64_t seed : {2, 3, 4}) {
    const Scene scene = ring(8, 3000, 0.03, 0.2, seed);
    const ColorGains found = color_gains(8, scene.samples);
    std::printf("a fifth outliers, 3%% noise: largest error %.2f%%\n",
                100 * largest_error(found, scene.gain));
    EXPECT_LT(largest_error(found, scene.gain), 0.015);
  }
}

TEST(ColorGains, StandardDeviations_MatchTheScatter) {
  constexpr int kRepeats = 20;
  double errors = 0;
  double said = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const Scene scene = ring(6, 600, 0.05, 0, 100 + static_cast<std::uint64_t>(repeat));
    const ColorGains found = color_gains(6, scene.samples);
    for (std::size_t c = 0; c < 6; ++c) {
      errors += (found.gain[c].array().log() - scene.gain[c].array().log()).square().sum();
      said += found.deviation[c].array().square().sum();
    }
  }
  EXPECT_LT(std::sqrt(errors / said), 2);
  EXPECT_GT(std::sqrt(errors / said), 0.5);
}

TEST(ColorGains, WhiteGloss_BarelyChangesTheGains) {
  // Half of the cameras see 4% of white light on everything.
  for (const std::uint64_t seed : {11, 12, 13}) {
    Scene scene = ring(8, 3000, 0.005, 0, seed);
    for (ColorSample& sample : scene.samples) {
      const auto c = static_cast<std::size_t>(sample.camera);
      sample.color += (c < 4 ? 0.01 : 0.0) * scene.gain[c];
    }
    EXPECT_LT(largest_error(color_gains(8, scene.samples), scene.gain), 0.006);
  }
}

TEST(ColorGains, GrayScene_GivesGainsFromBrightness) {
  Scene scene = ring(8, 3000, 0, 0, 14);
  for (ColorSample& sample : scene.samples) {
    sample.color =
        (0.1 + 1e-4 * sample.point) * scene.gain[static_cast<std::size_t>(sample.camera)];
  }
  EXPECT_LT(largest_error(color_gains(8, scene.samples), scene.gain), 1e-6);
}

TEST(ColorGains, CameraWithoutOverlap_KeepsGainOneWithAFinding) {
  Scene scene = ring(5, 1000, 0.01, 0, 7);
  scene.samples.push_back({5, 100000, Eigen::Vector3d::Constant(0.2), 1});
  const ColorGains found = color_gains(6, scene.samples);
  EXPECT_EQ(found.gain[5], Eigen::Vector3d::Ones().eval());
  ASSERT_EQ(found.findings.size(), 1U);
  EXPECT_EQ(found.findings[0].code, "color-few-points");
  EXPECT_EQ(found.findings[0].place, "5");
}

TEST(ColorGains, DarkOrClippedSamples_AreLeftOut) {
  Scene scene = ring(4, 1000, 0, 0, 9);
  for (std::size_t i = 0; i < scene.samples.size(); i += 5) {
    scene.samples[i].color.setConstant(i % 2 == 0 ? 1.0 : 1e-4);
  }
  EXPECT_LT(largest_error(color_gains(4, scene.samples), scene.gain), 1e-6);
}

TEST(ColorGains, NoOverlapOrNoCameras_AreRefused) {
  std::vector<ColorSample> apart;
  for (int p = 0; p < 200; ++p) {
    apart.push_back({p % 2, p, Eigen::Vector3d::Constant(0.3), 1});
  }
  ATELIER_EXPECT_REFUSED(color_gains(2, apart), DataError, "no two cameras that share 50 places");
  ATELIER_EXPECT_REFUSED(color_gains(1, apart), LogicError, "a camera that is not there");
  ATELIER_EXPECT_REFUSED(color_gains(2, {}), DataError, "no two cameras");
}

TEST(GainError, CommonFactor_IsIgnoredAndTheRestIsMeasured) {
  std::vector<Camera> truth(3);
  for (std::size_t c = 0; c < truth.size(); ++c) {
    truth[c].id = std::to_string(c);
    truth[c].gain = {1 + 0.1 * static_cast<double>(c), 1, 0.9};
  }
  std::vector<Camera> cameras = {truth[2], truth[0], truth[1]};  // another order
  for (Camera& camera : cameras) {
    camera.gain = camera.gain.cwiseProduct(Eigen::Vector3d(2, 0.5, 3));
  }
  EXPECT_NEAR(gain_error(cameras, truth).largest, 0, 1e-12);
  cameras[0].gain[1] *= std::exp(0.03);  // 0.02 above the mean, the others 0.01 below
  const GainError error = gain_error(cameras, truth);
  EXPECT_NEAR(error.largest, 0.02, 1e-12);
  EXPECT_NEAR(error.mean, (0.02 + 0.01 + 0.01) / 9, 1e-12);
  EXPECT_EQ(gain_error({}, truth).mean, 0);
}

TEST(GainError, UnknownCameraOrBadGain_IsRefused) {
  std::vector<Camera> cameras(1);
  cameras[0].id = "left";
  ATELIER_EXPECT_REFUSED(gain_error(cameras, std::vector<Camera>(1)), DataError, "'left'");
  std::vector<Camera> dark = cameras;
  dark[0].gain[2] = 0;
  ATELIER_EXPECT_REFUSED(gain_error(dark, cameras), DataError, "a gain that is none");
  ATELIER_EXPECT_REFUSED(gain_error(cameras, dark), DataError, "a gain that is none");
}

}  // namespace
}  // namespace atelier::fixtures
