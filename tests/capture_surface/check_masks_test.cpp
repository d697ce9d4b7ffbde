#include "capture/surface/check_masks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/capture_stereo/textured_ball.h"

namespace atelier::fixtures {
namespace {

using ::testing::Each;

struct Masks {
  std::vector<Camera> cameras;
  std::vector<ByteImage> masks;
};

Masks masks_of_ball(int views) {
  const TexturedBall ball;
  Masks all;
  for (const StereoView& view : ball.views(views, 2 * 3.14159265 / views, 60, 60)) {
    ByteImage mask(60, 60, 1);
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        mask.at(x, y) = ball.depth(view.camera, x + 0.5, y + 0.5) ? 255 : 0;
      }
    }
    all.cameras.push_back(view.camera);
    all.masks.push_back(mask);
  }
  return all;
}

void invert(ByteImage& mask) {
  for (std::uint8_t& pixel : mask.data) {
    pixel = pixel != 0 ? 0 : 255;
  }
}

TEST(CheckMasks, ValidMasks_AreGood) {
  for (const int views : {2, 3, 4, 5, 8, 20}) {
    const Masks all = masks_of_ball(views);
    EXPECT_THAT(check_masks(all.cameras, all.masks), Each(MaskFit::Good)) << views;
  }
}

TEST(CheckMasks, QuarterInvertedMasks_AreIdentified) {
  Masks all = masks_of_ball(12);
  for (const std::size_t wrong : {2u, 3u, 7u}) {
    invert(all.masks[wrong]);
  }
  const auto fits = check_masks(all.cameras, all.masks);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    EXPECT_EQ(fits[i], i == 2 || i == 3 || i == 7 ? MaskFit::Inverted : MaskFit::Good) << i;
  }
}

TEST(CheckMasks, EmptyMask_IsOffAndAbsentMaskIsNot) {
  Masks all = masks_of_ball(8);
  std::fill(all.masks[1].data.begin(), all.masks[1].data.end(), std::uint8_t{0});
  all.masks[4] = {};
  const auto fits = check_masks(all.cameras, all.masks);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    EXPECT_EQ(fits[i], i == 1 ? MaskFit::Off : MaskFit::Good) << i;
  }
}

TEST(CheckMasks, EmptyMaskAmongThree_CannotBeTold) {
  Masks all = masks_of_ball(3);
  std::fill(all.masks[0].data.begin(), all.masks[0].data.end(), std::uint8_t{0});
  EXPECT_THAT(check_masks(all.cameras, all.masks), Each(MaskFit::Good));
}

TEST(CheckMasks, MasksSetAroundTheBorder_AreInverted) {
  for (const int views : {2, 3, 8}) {
    Masks all = masks_of_ball(views);
    for (ByteImage& mask : all.masks) {
      invert(mask);
    }
    EXPECT_THAT(check_masks(all.cameras, all.masks), Each(MaskFit::Inverted)) << views;
  }
}

TEST(CheckMasks, FullMask_IsNotCalledInverted) {
  Masks all = masks_of_ball(3);
  std::fill(all.masks[0].data.begin(), all.masks[0].data.end(), std::uint8_t{255});
  EXPECT_THAT(check_masks(all.cameras, all.masks), Each(MaskFit::Good));
}

TEST(CheckMasks, OtherCountsOrSizes_AreRefused) {
  Masks all = masks_of_ball(4);
  all.masks[2] = ByteImage(30, 60, 1);
  EXPECT_THROW(check_masks(all.cameras, all.masks), LogicError);
  all.masks.pop_back();
  EXPECT_THROW(check_masks(all.cameras, all.masks), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
