// The invisible mark: its code, that it is found again after what images go through, and that
// nothing is found where there is none.
#include "core/mark/image_mark.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/image_file.h"
#include "core/mark/mark_code.h"
#include "core/mark/mark_pattern.h"
#include "core/random.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

std::uint64_t any_bits(Random& random) {
  return uniform_index(random, std::uint64_t{1} << 32) << 32 |
         uniform_index(random, std::uint64_t{1} << 32);
}

/// A shaded ball, striped in the middle, before an even background: a person of a kind.
ByteImage ball_image(int width, int height) {
  ByteImage image(width, height, 3, 230);
  Random random{.seed = 7};
  const double radius = 0.35 * std::min(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dx = (x - width / 2) / radius;
      const double dy = (y - height / 2) / radius;
      const double inside = 1 - dx * dx - dy * dy;
      if (inside > 0) {
        const double light = 60 + 120 * std::sqrt(inside) * (0.7 + 0.3 * std::sin(0.4 * x)) +
                             uniform(random, -12, 12);
        for (int c = 0; c < 3; ++c) {
          image.at(x, y, c) = saturating_cast<std::uint8_t>(std::clamp(light - 15 * c, 0.0, 255.0));
        }
      }
    }
  }
  return image;
}

/// Every third mean of 3 x 3 pixels.
ByteImage third(const ByteImage& image) {
  ByteImage small(image.width / 3, image.height / 3, 3);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 4;
        for (int k = 0; k < 9; ++k) {
          sum += image.at(3 * x + k % 3, 3 * y + k / 3, c);
        }
        small.at(x, y, c) = static_cast<std::uint8_t>(sum / 9);
      }
    }
  }
  return small;
}

ByteImage part_of(const ByteImage& image, int left, int top, int width, int height) {
  ByteImage part(width, height, image.channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        part.at(x, y, c) = image.at(left + x, top + y, c);
      }
    }
  }
  return part;
}

ByteImage with_gamma(ByteImage image, double exponent) {
  for (std::uint8_t& value : image.data) {
    value = saturating_cast<std::uint8_t>(
        std::round(255 * std::pow(static_cast<double>(value) / 255, exponent)));
  }
  return image;
}

ByteImage as_jpeg(const ByteImage& image, int quality) {
  const std::string bytes = image_bytes(image, ImageFormat::Jpeg, {.quality = quality});
  return read_byte_image(std::as_bytes(std::span(bytes)), "a.jpg");
}

double psnr_of(const ByteImage& one, const ByteImage& other) {
  double squares = 0;
  for (std::size_t i = 0; i < one.data.size(); ++i) {
    squares += std::pow(static_cast<double>(one.data[i]) - other.data[i], 2);
  }
  return 10 * std::log10(255.0 * 255 * static_cast<double>(one.data.size()) / squares);
}

TEST(MarkCode, NoisyCode_IsDecoded) {
  Random random{.seed = 53};
  for (int i = 0; i < 20; ++i) {
    const std::uint64_t bits = any_bits(random);
    std::vector<float> soft;
    for (const std::uint8_t bit : mark_code(bits)) {
      soft.push_back(static_cast<float>((bit != 0 ? -1 : 1) + 0.9 * normal(random)));
    }
    const DecodedMark decoded = decode_mark(soft);
    EXPECT_EQ(decoded.bits, bits);
    EXPECT_EQ(decoded.difference, 0u);
  }
}

TEST(MarkCode, Noise_HasAnyChecksum) {
  Random random{.seed = 54};
  int low = 0;
  constexpr int kCount = 1280;
  for (int i = 0; i < kCount; ++i) {
    std::vector<float> soft(kMarkCodeBits);
    for (float& value : soft) {
      value = static_cast<float>(normal(random));
    }
    const DecodedMark decoded = decode_mark(soft);
    EXPECT_NE(decoded.difference, 0u);
    low += (decoded.difference & 0xFF) == 0 ? 1 : 0;
  }
  EXPECT_NEAR(low, 5, 9);  // a Poisson number of mean 5
  EXPECT_NE(decode_mark(std::vector<float>(kMarkCodeBits)).difference, 0u);
  EXPECT_THROW(decode_mark(std::vector<float>(5)), LogicError);
}

TEST(MarkPattern, Tile_HasUnitSizeAndNoMean) {
  const std::vector<float> tile = mark_tile(0x0123456789abcdef);
  ASSERT_EQ(tile.size(), std::size_t{kMarkTile} * kMarkTile);
  double sum = 0;
  double squares = 0;
  for (const float value : tile) {
    sum += value;
    squares += value * value;
  }
  EXPECT_NEAR(sum / static_cast<double>(tile.size()), 0, 1e-4);
  EXPECT_NEAR(squares / static_cast<double>(tile.size()), 1, 1e-3);
  EXPECT_EQ(std::ssize(mark_carriers().code), kMarkCodeBits);
  EXPECT_GT(mark_carriers().pilots.size(), 150u);
}

TEST(ImageMark, MarkedImage_LooksTheSame) {
  const ByteImage image = ball_image(600, 800);
  ByteImage marked = image;
  ImageMark(0x0123456789abcdef).add_to(marked);
  EXPECT_GT(psnr_of(image, marked), 42);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    ASSERT_LE(std::abs(image.data[i] - marked.data[i]), 16);
  }
}

TEST(ImageMark, WhatImagesGoThrough_LeavesIt) {
  // Fresh bits every time: what holds, holds of any.
  Random random{.seed = static_cast<std::uint64_t>(
                    std::chrono::system_clock::now().time_since_epoch().count())};
  const std::uint64_t bits = any_bits(random);
  ByteImage marked = ball_image(600, 800);
  ImageMark(bits).add_to(marked);
  const auto expect_found = [&](const char* after, const ByteImage& image, double size) {
    const auto found = find_mark(mark_brightness(image)).found;
    ASSERT_TRUE(found) << after << ", bits " << bits;
    EXPECT_EQ(found->bits, bits) << after;
    EXPECT_NEAR(found->size, size, 0.01 * size) << after;
  };
  expect_found("nothing", marked, 1);
  expect_found("JPEG 70", as_jpeg(marked, 70), 1);
  expect_found("a third of the size", third(marked), 1.0 / 3);
  expect_found("the left half", part_of(marked, 0, 0, 300, 800), 1);
  expect_found("the lower half", part_of(marked, 0, 400, 600, 400), 1);
  expect_found("a screenshot's gamma", with_gamma(marked, 1.25), 1);
  expect_found("a screenshot's gamma", with_gamma(marked, 0.8), 1);
}

TEST(ImageMark, UnmarkedImage_HasNone) {
  const MarkSearch search = find_mark(mark_brightness(ball_image(600, 800)));
  EXPECT_FALSE(search.found);
  EXPECT_GT(search.tried.size(), 8u);
  EXPECT_LE(std::ssize(search.tried), kMarkTries);
  EXPECT_FALSE(find_mark(mark_brightness(ByteImage(64, 64, 3, 200))).found);
  for (const auto& [width, height] : {std::pair{3, 3}, {1, 4000}, {24, 1500}, {191, 25}}) {
    for (const int grey : {0, 200, 255}) {
      const ByteImage image(width, height, 3, static_cast<std::uint8_t>(grey));
      EXPECT_FALSE(find_mark(mark_brightness(image)).found) << width << " x " << height;
    }
  }
}

TEST(ImageMark, TransparentPixels_StayAsTheyAre) {
  ByteImage image(200, 200, 4, 128);
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      image.at(x, y, 3) = x < 100 ? 0 : 255;
    }
  }
  ByteImage marked = image;
  ImageMark(1).add_to(marked);
  bool changed = false;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      EXPECT_EQ(marked.at(x, y, 3), image.at(x, y, 3));
      changed = changed || (x >= 100 && marked.at(x, y) != 128);
      if (x < 100) {
        ASSERT_EQ(marked.at(x, y), 128);
      }
    }
  }
  EXPECT_TRUE(changed);
  ByteImage grey(20, 20, 1);
  EXPECT_THROW(ImageMark(1).add_to(grey), LogicError);
  EXPECT_THROW(find_mark(ImageOf<float>(50, 50, 3)), LogicError);
  EXPECT_THROW(find_mark(ImageOf<float>(50, 50, 1), {.smallest = 2, .largest = 1}), LogicError);
}

}  // namespace
}  // namespace atelier
