// Masks of the built-in detector at the image's own borders.

#include "capture/people/person_mask.h"

#include <cmath>

#include <gtest/gtest.h>

#include "capture/masks/background.h"
#include "core/error.h"

namespace atelier::fixtures {
namespace {

constexpr int kWidth = 600;
constexpr int kHeight = 500;

/// Somebody in an image: an ellipse of another colour, with shading and noise; `turn` rad.
struct Seen {
  ByteImage image{kWidth, kHeight, 3};
  ByteImage truth{kWidth, kHeight, 1};
  PersonLandmarks person;
};

Seen ellipse(double turn, int contrast) {
  Seen seen;
  seen.person.presence = 1;
  seen.person.crop = {{290, 255}, 480, turn};
  std::uint32_t noise = 1;
  const auto inside = [](const Eigen::Vector2d& at) {
    const Eigen::Vector2d offset = at - Eigen::Vector2d(300, 250);
    return std::pow(offset.x() / 70, 2) + std::pow(offset.y() / 180, 2) <= 1;
  };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool in = inside({x + 0.5, y + 0.5});
      seen.truth.at(x, y, 0) = in ? 255 : 0;
      for (int c = 0; c < 3; ++c) {
        noise = noise * 1664525 + 1013904223;
        const int base = 90 + x / 20 + (in && c != 1 ? contrast : 0);
        seen.image.at(x, y, c) = static_cast<std::uint8_t>(base + static_cast<int>(noise >> 30));
      }
    }
  }
  // The network's own mask is coarse, soft, and off by one of its pixels.
  seen.person.mask = ByteImage(kLandmarkInput, kLandmarkInput, 1);
  for (int v = 0; v < kLandmarkInput; ++v) {
    for (int u = 0; u < kLandmarkInput; ++u) {
      double sum = 0;
      int count = 0;
      for (int dv = -3; dv <= 3; ++dv) {
        for (int du = -3; du <= 3; ++du) {
          sum += inside(from_crop(seen.person.crop, {(u + 1 + du + 0.5) / kLandmarkInput,
                                                     (v + 1 + dv + 0.5) / kLandmarkInput}))
                     ? 1
                     : 0;
          ++count;
        }
      }
      seen.person.mask.at(u, v, 0) = static_cast<std::uint8_t>(255 * sum / count);
    }
  }
  return seen;
}

TEST(PeopleMask, CoarseMask_MovesToTheImagesBorders) {
  for (const double turn : {0.0, 0.4, -1.2}) {
    const Seen seen = ellipse(turn, 60);
    PeopleMaskOptions coarse;
    coarse.reach = 0;
    const double before = mask_iou(people_mask({seen.person}, seen.image, coarse), seen.truth);
    const double after = mask_iou(people_mask({seen.person}, seen.image), seen.truth);
    EXPECT_GT(before, 0.85) << turn;
    EXPECT_GT(after, before) << turn;
    EXPECT_GT(after, 0.98) << turn;
  }
}

TEST(PeopleMask, ImageWithoutBorders_KeepsTheCoarseMask) {
  const Seen seen = ellipse(0.3, 0);
  PeopleMaskOptions coarse;
  coarse.reach = 0;
  EXPECT_GT(mask_iou(people_mask({seen.person}, seen.image),
                     people_mask({seen.person}, seen.image, coarse)),
            0.9);
}

TEST(PeopleMask, CropBeyondTheImage_CoversWhatIsInIt) {
  Seen seen = ellipse(0, 60);
  for (std::uint8_t& value : seen.person.mask.data) {
    value = 255;
  }
  seen.person.crop = {{0, 0}, 200, 0};
  PeopleMaskOptions coarse;
  coarse.reach = 0;
  const ByteImage mask = people_mask({seen.person}, seen.image, coarse);
  EXPECT_EQ(mask.at(50, 50, 0), 255);
  EXPECT_EQ(mask.at(99, 99, 0), 255);
  EXPECT_EQ(mask.at(101, 50, 0), 0);
  seen.person.crop.center = {1e12, -1e12};
  EXPECT_EQ(mask_iou(people_mask({seen.person}, seen.image), ByteImage(kWidth, kHeight, 1)), 1);
}

TEST(PeopleMask, GreyImage_IsRead_AndOthersAreRefused) {
  const Seen seen = ellipse(0, 60);
  ByteImage grey(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      grey.at(x, y, 0) = seen.image.at(x, y, 0);
    }
  }
  EXPECT_GT(mask_iou(people_mask({seen.person}, grey), seen.truth), 0.97);
  EXPECT_EQ(mask_iou(people_mask({}, grey), ByteImage(kWidth, kHeight, 1)), 1);
  EXPECT_THROW(people_mask({}, ByteImage(10, 10, 4)), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
