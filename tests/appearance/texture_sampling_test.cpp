#include "appearance/texture_sampling.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

Image random_texture(int size, std::uint64_t seed) {
  Random random{seed};
  Image image(size, size, 3);
  for (float& value : image.data) {
    value = static_cast<float>(uniform(random, 0.1, 0.9));
  }
  return image;
}

TexturePixels random_places(int count, std::uint64_t seed) {
  Random random{seed};
  TexturePixels places;
  for (int i = 0; i < count; ++i) {
    places.u.push_back(static_cast<float>(uniform(random)));
    places.v.push_back(static_cast<float>(uniform(random)));
  }
  return places;
}

TEST(TextureSampling, TexelCentre_GivesTheTexel) {
  const Image texture = random_texture(8, 1);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      const TexturePixels place{{(x + 0.5F) / 8}, {1 - (y + 0.5F) / 8}, {}};
      const std::vector<float> color = sample_texture(texture, place);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(color[c], texture.at(x, y, c), 1e-5F);
      }
    }
  }
}

TEST(TextureSampling, Ramp_IsInterpolatedAndClampedAtTheBorder) {
  Image ramp(16, 16, 3);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      ramp.at(x, y, 0) = (x + 0.5F) / 16;
      ramp.at(x, y, 1) = 1 - (y + 0.5F) / 16;
    }
  }
  const TexturePixels places = random_places(200, 2);
  const std::vector<float> colors = sample_texture(ramp, places);
  for (std::size_t i = 0; i < places.u.size(); ++i) {
    EXPECT_NEAR(colors[3 * i], std::clamp(places.u[i], 0.5F / 16, 15.5F / 16), 1e-5F);
    EXPECT_NEAR(colors[3 * i + 1], std::clamp(places.v[i], 0.5F / 16, 15.5F / 16), 1e-5F);
  }
}

TEST(StaticTexture, TextureAndCameraGains_AreRecovered) {
  const Image truth = random_texture(8, 6);
  const float gains[3][3] = {{1.1F, 1.0F, 0.9F}, {1.0F, 1.0F, 1.0F}, {0.8F, 1.05F, 1.0F}};
  std::vector<TexturePixels> pictures;
  for (int c = 0; c < 3; ++c) {
    pictures.push_back(random_places(1500, 10 + c));
    pictures.back().colors = sample_texture(truth, pictures.back());
    for (std::size_t i = 0; i < pictures.back().colors.size(); ++i) {
      pictures.back().colors[i] *= gains[c][i % 3];
    }
  }
  const StaticTexture found =
      static_texture(8, 3, {{0, &pictures[0]}, {1, &pictures[1]}, {2, &pictures[2]}}, 40);
  for (int k = 0; k < 3; ++k) {
    const double middle = std::cbrt(static_cast<double>(gains[0][k]) * gains[1][k] * gains[2][k]);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(found.gain[3 * c + k], gains[c][k] / middle, 2e-3);
    }
  }
  double worst = 0;
  for (const TexturePixels& picture : pictures) {
    const std::vector<float> shown = sample_texture(found.texture, picture);
    const int c = static_cast<int>(&picture - pictures.data());
    for (std::size_t i = 0; i < shown.size(); ++i) {
      worst = std::max(worst, std::abs(static_cast<double>(shown[i] * found.gain[3 * c + i % 3] -
                                                           picture.colors[i])));
    }
  }
  EXPECT_LT(worst, 0.02);
  EXPECT_EQ(found.seen.at(3, 3), 1);
}

// A slope of light, seen by pixels with errors of a tenth: by two or three a texel, or by hundreds.
TEST(StaticTexture, Smoothness_TakesTheErrorsOfFewPixelsAndKeepsWhatManyShow) {
  Image truth(32, 32, 3);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      for (int c = 0; c < 3; ++c) {
        truth.at(x, y, c) = 0.3F + 0.01F * static_cast<float>(x) + (y < 16 ? 0.2F : 0.0F);
      }
    }
  }
  const auto error = [&](int pixels, double smoothness) {
    TexturePixels places = random_places(pixels, 21);
    places.colors = sample_texture(truth, places);
    Random random{7};
    for (float& color : places.colors) {
      color += 0.1F * static_cast<float>(uniform(random, -1, 1));
    }
    const StaticTexture found = static_texture(32, 1, {{0, &places}}, 6, smoothness);
    double sum = 0;
    double count = 0;
    for (std::size_t i = 0; i < truth.data.size(); ++i) {
      if (found.seen.data[i / 3] != 0) {
        sum += std::pow(found.texture.data[i] - truth.data[i], 2);
        ++count;
      }
    }
    EXPECT_GT(count, 0.7 * static_cast<double>(truth.data.size()));
    return std::sqrt(sum / count);
  };
  EXPECT_LT(error(2500, 3), 0.5 * error(2500, 0)) << error(2500, 3) << " " << error(2500, 0);
  EXPECT_LT(error(400'000, 3), 0.01) << error(400'000, 0);
}

TEST(TextureSamplingRefused, MismatchedInput_IsRefused) {
  const TexturePixels places = random_places(3, 7);
  ATELIER_EXPECT_REFUSED(sample_texture(Image(4, 5, 3), places), LogicError, "square");
  ATELIER_EXPECT_REFUSED(static_texture(4, 1, {{0, &places}}), LogicError, "colours");
  ATELIER_EXPECT_REFUSED(static_texture(4, 1, {{1, &places}}), LogicError, "a camera");
}

}  // namespace
}  // namespace atelier
