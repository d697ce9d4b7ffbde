#include "appearance/static_fit.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Five cameras that see every texel of 16 x 16 in two frames, of a print that light changes by a
/// tenth. `shifts` says by how many texels each camera's images are off.
AppearanceData printed(const std::vector<int>& shifts) {
  constexpr int kSide = 16;
  AppearanceData data;
  for (std::size_t c = 0; c < shifts.size(); ++c) {
    data.camera_ids.push_back(std::to_string(c));
    for (int f = 0; f < 2; ++f) {
      AppearanceView view;
      view.camera_idx = static_cast<int>(c);
      view.frame_idx = f;
      for (int i = 0; i < kSide * kSide; ++i) {
        view.pixel.push_back(i);
        view.u.push_back((static_cast<float>(i % kSide) + 0.5F) / kSide);
        view.v.push_back(1 - (static_cast<float>(i / kSide) + 0.5F) / kSide);
        const int from = (i + 97 * shifts[c]) % (kSide * kSide);
        for (int k = 0; k < 3; ++k) {
          const double print = 128 + 100 * std::sin(1.7 * from * (from % 7) + k);
          view.colors.push_back(static_cast<std::uint8_t>(print * (f == 0 ? 1.0 : 0.9)));
        }
      }
      data.views.push_back(std::move(view));
    }
  }
  return data;
}

TEST(StaticFit, ConsistentCameras_AreExplained) {
  const StaticFit fit = static_fit(printed({0, 0, 0, 0, 0}), 16);
  EXPECT_GT(fit.psnr, 25);
  ASSERT_EQ(fit.camera_explained.size(), 5U);
  for (const double explained : fit.camera_explained) {
    EXPECT_GT(explained, 0.9);
  }
  EXPECT_THAT(contradicting_cameras(fit), IsEmpty());
  EXPECT_FALSE(max_contradict(fit));
}

TEST(StaticFit, CamerasWithOtherImages_AreNamed) {
  const StaticFit fit = static_fit(printed({0, 1, 0, 0, 2}), 16);
  EXPECT_THAT(contradicting_cameras(fit), ElementsAre(1, 4));
  EXPECT_FALSE(max_contradict(fit));
}

TEST(StaticFit, MostCamerasContradicting_IsDetected) {
  EXPECT_TRUE(max_contradict(static_fit(printed({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}), 16)));
}

TEST(StaticFit, JudgedTexels_HoldManyPixelsEach) {
  AppearanceData data = printed({0});
  EXPECT_EQ(judged_texels(data), 16) << "as few as there are";
  const auto pixels_of_a_view = [&](std::size_t count) {
    data.views.resize(1);
    data.views[0].pixel.assign(count, 0);
    return judged_texels(data);
  };
  EXPECT_EQ(pixels_of_a_view(32 * 64 * 64), 64);
  EXPECT_EQ(pixels_of_a_view(32 * 64 * 64 - 1), 63);
  EXPECT_EQ(pixels_of_a_view(32 * 300 * 300), kJudgedTexels);
}

TEST(StaticFit, CameraWithoutImages_IsNotJudged) {
  AppearanceData data = printed({0, 0, 0});
  data.camera_ids.emplace_back("blind");
  const StaticFit fit = static_fit(data, 16);
  EXPECT_TRUE(std::isnan(fit.camera_psnr[3]));
  EXPECT_THAT(contradicting_cameras(fit), IsEmpty());
}

}  // namespace
}  // namespace atelier::fixtures
