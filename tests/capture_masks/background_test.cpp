// Masks of drawn scenes whose ground truth is known: plates, a coloured screen, statistics over
// time.

#include "capture/masks/background.h"

#include <Eigen/Core>
#include <cmath>
#include <cstdio>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 200;

struct Shot {
  Image image;
  ByteImage truth;
};

/// A stage: a wall that darkens upwards and a floor, or a screen of one colour.
Eigen::Vector3f stage_color(int x, int y, bool screen) {
  const float shade = 0.7F + 0.3F * static_cast<float>(y) / kHeight + 0.02F * std::sin(0.3F * x);
  if (screen) {
    return shade * Eigen::Vector3f(0.03F, 0.45F, 0.08F);
  }
  return shade *
         (y < 150 ? Eigen::Vector3f(0.35F, 0.36F, 0.40F) : Eigen::Vector3f(0.30F, 0.24F, 0.18F));
}

/// A person of ellipses at `centre`, with a shadow on the floor beside her; noise in everything.
/// @param folds  phase of the shades that the folds of her clothes have
Shot shot(float centre, bool person, std::uint64_t seed, bool screen = false, float noise = 0.004F,
          float folds = 0) {
  Random random{seed, 1};
  Shot shot{Image(kWidth, kHeight, 3), ByteImage(kWidth, kHeight, 1)};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      Eigen::Vector3f color = stage_color(x, y, screen);
      const auto inside = [&](float cx, float cy, float rx, float ry) {
        const float dx = (static_cast<float>(x) - cx) / rx;
        const float dy = (static_cast<float>(y) - cy) / ry;
        return dx * dx + dy * dy < 1;
      };
      if (person && y > 165 && inside(centre + 22, 183, 26, 7)) {
        color *= 0.6F;  // her shadow
      }
      if (person) {
        const bool head = inside(centre, 38, 10, 13);
        const bool torso = inside(centre, 85, 19, 36);
        const bool legs = inside(centre - 9, 145, 8, 40) || inside(centre + 9, 145, 8, 40);
        if (head) {
          color = {0.55F, 0.35F, 0.25F};
        } else if (torso) {
          color = Eigen::Vector3f(0.5F, 0.06F, 0.08F) * (0.8F + 0.2F * std::sin(0.5F * y + folds));
        } else if (legs) {
          color = {0.05F, 0.07F, 0.2F};
        }
        shot.truth.at(x, y) = head || torso || legs ? 1 : 0;
      }
      for (int c = 0; c < 3; ++c) {
        shot.image.at(x, y, c) = std::max(
            0.0F, color[c] + noise * std::sqrt(color[c] * 10) * static_cast<float>(normal(random)));
      }
    }
  }
  return shot;
}

TEST(Masks, CleanPlates_ExcludeTheShadow) {
  const EmptyStage background =
      background_of_plates({shot(0, false, 1).image, shot(0, false, 2).image});
  double iou = 0;
  for (const float centre : {50.0F, 80.0F, 110.0F}) {
    const Shot one = shot(centre, true, 7);
    iou += mask_iou(mask_from_background(one.image, background), one.truth) / 3;
  }
  std::printf("plates: IoU %.4f\n", iou);
  EXPECT_GT(iou, 0.97);
  MaskOptions with_shadow;
  with_shadow.shadow_darkest = 1;
  const Shot one = shot(80, true, 7);
  EXPECT_LT(mask_iou(mask_from_background(one.image, background, with_shadow), one.truth),
            mask_iou(mask_from_background(one.image, background), one.truth) - 0.02);
}

TEST(Masks, OnePlateOrManyNoisyPlates_GiveGoodMasks) {
  const Shot one = shot(80, true, 7, false, 0.02F);
  const EmptyStage single = background_of_plates({shot(0, false, 1, false, 0.02F).image});
  EXPECT_GT(mask_iou(mask_from_background(one.image, single), one.truth), 0.9);
  std::vector<Image> plates;
  for (std::uint64_t i = 0; i < 10; ++i) {
    plates.push_back(shot(0, false, 20 + i, false, 0.02F).image);
  }
  EXPECT_GT(mask_iou(mask_from_background(one.image, background_of_plates(plates)), one.truth),
            0.9);
}

TEST(Masks, EmptyStage_GivesEmptyMask) {
  const EmptyStage background = background_of_plates({shot(0, false, 1).image});
  const ByteImage mask = mask_from_background(shot(0, false, 5).image, background);
  EXPECT_EQ(std::count(mask.data.begin(), mask.data.end(), 0), kWidth * kHeight);
}

TEST(Masks, ColoredScreen_GivesMaskByChroma) {
  const Shot one = shot(80, true, 7, true);
  const double given = mask_iou(mask_by_chroma(one.image, {.key = {0.03, 0.45, 0.08}}), one.truth);
  const double told = mask_iou(mask_by_chroma(one.image, {.key = {0, 0, 0}}), one.truth);
  std::printf("chroma: IoU %.4f with the key given, %.4f told from the borders\n", given, told);
  EXPECT_GT(given, 0.97);
  EXPECT_GT(told, 0.97);
}

TEST(Masks, BackgroundOverTime_GivesMask) {
  std::vector<Image> frames;
  for (int i = 0; i < 15; ++i) {
    frames.push_back(
        shot(20.0F + 8.0F * static_cast<float>(i), true, static_cast<std::uint64_t>(40 + i)).image);
  }
  const MovingBackground moving = background_over_time(frames);
  EXPECT_LT(moving.still_share, 0.1);
  const Shot one = shot(76, true, 90);
  const double iou = mask_iou(mask_over_time(one.image, moving), one.truth);
  std::printf("over time: IoU %.4f, doubtful share %.3f\n", iou, moving.still_share);
  EXPECT_GT(iou, 0.95);
}

TEST(Masks, BackgroundCoveredForMostFrames_IsFound) {
  // In 14 of 24 frames she stands in the middle; her clothes never shade alike.
  std::vector<Image> frames;
  for (int i = 0; i < 24; ++i) {
    const float centre = i % 12 < 5 ? (i < 12 ? 25.0F : 135.0F) : 80.0F;
    frames.push_back(shot(centre, true, static_cast<std::uint64_t>(200 + i), false, 0.004F,
                          0.7F * static_cast<float>(i * i))
                         .image);
  }
  const MovingBackground moving = background_over_time(frames);
  const Shot one = shot(80, true, 90, false, 0.004F, 1.3F);
  const ByteImage mask = mask_over_time(one.image, moving);
  int torso = 0;
  for (int y = 55; y < 115; ++y) {
    torso += mask.at(80, y) != 0 ? 1 : 0;
  }
  EXPECT_GT(torso, 57);
}

TEST(Masks, PrintedDressThatStaysInPlace_IsFilled) {
  // In four of five frames she sways about one place; the print of her dress shades as it likes.
  std::vector<Image> frames;
  const auto printed = [](int i, std::uint64_t seed) {
    Shot one = shot(i % 5 == 4 ? 120.0F : 80.0F + 2.0F * std::sin(1.9F * static_cast<float>(i)),
                    true, seed);
    Random random{seed, 3};
    for (int y = 49; y < 121; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (one.truth.at(x, y) != 0) {
          const auto shade = static_cast<float>(uniform(random, 0.1, 1));
          for (int c = 0; c < 3; ++c) {
            one.image.at(x, y, c) *= shade;
          }
        }
      }
    }
    return one;
  };
  for (int i = 0; i < 30; ++i) {
    frames.push_back(printed(i, static_cast<std::uint64_t>(400 + i)).image);
  }
  const MovingBackground moving = background_over_time(frames);
  const Shot one = printed(2, 402);
  const ByteImage mask = mask_over_time(one.image, moving);
  int torso = 0;
  int open = 0;
  for (int y = 60; y < 110; ++y) {
    for (int x = 70; x < 90; ++x) {
      torso += mask.at(x, y) != 0 ? 1 : 0;
      open += mask.at(x - 60, y) != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(torso, 0.98 * 50 * 20);
  EXPECT_EQ(open, 0);
}

/// A stage with a background that has learnt a patch of the person's shirt, where nothing was seen
/// in the open.
struct Learnt {
  MovingBackground moving;
  Image image;
};

Learnt learnt(bool shirt, bool open) {
  Learnt made{{background_of_plates({shot(0, false, 1).image}), ByteImage(kWidth, kHeight, 1), 0,
               ByteImage(kWidth, kHeight, 1)},
              shot(80, true, 2).image};
  std::fill(made.moving.seen_open.data.begin(), made.moving.seen_open.data.end(),
            static_cast<std::uint8_t>(255));
  for (int y = 70; y < 100; ++y) {
    for (int x = 72; x < 88; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (shirt) {
          made.moving.background.mean.at(x, y, c) = made.image.at(x, y, c);
        } else {
          made.image.at(x, y, c) = made.moving.background.mean.at(x, y, c);
        }
      }
      made.moving.seen_open.at(x, y) = open ? 255 : 0;
    }
  }
  return made;
}

TEST(Masks, HoleOfWhatNeverMoved_IsFilled) {
  const Learnt made = learnt(true, false);
  EXPECT_EQ(mask_from_background(made.image, made.moving.background).at(80, 85), 0);
  EXPECT_EQ(mask_over_time(made.image, made.moving).at(80, 85), 255);
}

TEST(Masks, HoleThatShowsBackground_StaysOpen) {
  const Learnt around = learnt(false, false);  // of the wall's colour, between arm and trunk
  EXPECT_EQ(mask_over_time(around.image, around.moving).at(80, 85), 0);
  const Learnt seen = learnt(true, true);  // seen in the open in other frames
  EXPECT_EQ(mask_over_time(seen.image, seen.moving).at(80, 85), 0);
}

TEST(Masks, OutlineThroughThePerson_IsTold) {
  const EmptyStage background = background_of_plates({shot(0, false, 1).image});
  const Shot one = shot(80, true, 7);
  const double right = outline_without_edge(one.image, one.truth, background);
  ByteImage cut = one.truth;  // the head and the legs below the knee never moved
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth && (y < 38 || y > 150); ++x) {
      cut.at(x, y) = 0;
    }
  }
  const double wrong = outline_without_edge(one.image, cut, background);
  std::printf("outline without an edge: %.3f of the true mask, %.3f of a cut one\n", right, wrong);
  EXPECT_LT(right, 0.03);
  EXPECT_GT(wrong, 0.06);
  EXPECT_EQ(outline_without_edge(one.image, ByteImage(kWidth, kHeight, 1), background), 0);
  ATELIER_EXPECT_REFUSED(outline_without_edge(one.image, ByteImage(3, 3, 1), background),
                         LogicError, "another size");
}

TEST(Masks, NearlyStillPerson_IsReportedDoubtful) {
  std::vector<Image> frames;
  for (int i = 0; i < 12; ++i) {
    frames.push_back(
        shot(80.0F + (i % 2 == 0 ? 12.0F : -12.0F), true, static_cast<std::uint64_t>(i)).image);
  }
  EXPECT_GT(background_over_time(frames).still_share, 0.05);
}

TEST(CleanMask, SmallHolesAndSpecks_AreRemoved) {
  ByteImage mask(60, 60, 1);
  for (int y = 10; y < 40; ++y) {
    for (int x = 10; x < 40; ++x) {
      mask.at(x, y) = 1;
    }
  }
  mask.at(20, 20) = 0;  // a hole
  mask.at(50, 50) = 1;  // a speck
  for (int y = 20; y < 35; ++y) {
    mask.at(26, y) = 0;  // a crack
  }
  const MaskOptions options{.opening = 16, .closing = 50, .max_hole = 0.001};  // 1 and 3 px
  const ByteImage clean = clean_mask(mask, options);
  EXPECT_EQ(clean.at(20, 20), 255);
  EXPECT_EQ(clean.at(50, 50), 0);
  EXPECT_EQ(clean.at(26, 27), 255);
  EXPECT_EQ(clean.at(5, 5), 0);
  ByteImage ring = mask;
  for (int y = 15; y < 35; ++y) {
    for (int x = 15; x < 35; ++x) {
      ring.at(x, y) = 0;  // between an arm and the body
    }
  }
  EXPECT_EQ(clean_mask(ring, options).at(25, 25), 0);
}

TEST(Masks, BadInput_IsRefused) {
  ATELIER_EXPECT_REFUSED(background_of_plates({}), DataError, "an image of the empty stage");
  ATELIER_EXPECT_REFUSED(background_of_plates({Image(4, 4, 3), Image(5, 4, 3)}), DataError,
                         "images of one size");
  ATELIER_EXPECT_REFUSED(background_over_time(std::vector<Image>(4, Image(8, 8, 3))), DataError,
                         "5 at least, or clean plates");
  const EmptyStage background = background_of_plates({Image(8, 8, 3)});
  ATELIER_EXPECT_REFUSED(mask_from_background(Image(9, 8, 3), background), LogicError,
                         "another size");
  ATELIER_EXPECT_REFUSED(mask_by_chroma(Image(8, 8, 3, 0.4F), {.key = {0.5, 0.5, 0.5}}), DataError,
                         "nearly grey");
  ATELIER_EXPECT_REFUSED(mask_by_chroma(Image(8, 8, 3, 0.4F), {.key = {0, 0, 0}}), DataError,
                         "nearly grey");
  ATELIER_EXPECT_REFUSED(mask_by_chroma(Image(8, 8, 1), {}), LogicError, "without colours");
  ATELIER_EXPECT_REFUSED(mask_iou(ByteImage(2, 2, 1), ByteImage(3, 2, 1)), LogicError, "two sizes");
}

TEST(Masks, NanAndEmptyImages_AreAccepted) {
  Image image(16, 16, 3, 0.3F);
  image.at(3, 3, 1) = std::numeric_limits<float>::quiet_NaN();
  const EmptyStage background = background_of_plates({Image(16, 16, 3, 0.3F)});
  EXPECT_EQ(mask_from_background(image, background).data.size(), 256U);
  EXPECT_TRUE(clean_mask(ByteImage()).data.empty());
}

}  // namespace
}  // namespace atelier::fixtures
