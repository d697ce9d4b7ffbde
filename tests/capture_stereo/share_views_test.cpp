#include "capture/stereo/share_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/stereo/choose_sources.h"
#include "core/error.h"

namespace atelier::fixtures {
namespace {

using ::testing::ElementsAre;

/// Sixteen cameras in pairs 15 degrees apart on eight posts, low and high in turn.
std::vector<Camera> sixteen_cameras() {
  constexpr double kDegree = 0.017453292519943295;
  std::vector<Camera> cameras;
  for (int i = 0; i < 16; ++i) {
    const int post = i / 2;
    const double azimuth = (45 * post + (i % 2 == 0 ? -7.5 : 7.5)) * kDegree;
    const Eigen::Vector3d centre(3.4 * std::sin(azimuth), post % 2 == 0 ? 0.5 : 2.4,
                                 3.4 * std::cos(azimuth));
    const Eigen::Vector3d z = (Eigen::Vector3d(0, 0.95, 0) - centre).normalized();
    const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z).normalized();
    Camera camera;
    camera.camera_from_world_rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
    cameras.push_back(camera);
  }
  return cameras;
}

std::size_t computed(const std::vector<std::vector<std::size_t>>& shares,
                     const std::vector<std::vector<int>>& sources) {
  return std::accumulate(shares.begin(), shares.end(), std::size_t{0},
                         [&](std::size_t sum, const std::vector<std::size_t>& share) {
                           return sum + with_sources(share, sources).size();
                         });
}

TEST(ShareViews, Shares_AreDisjointAndComplete) {
  const std::vector<Camera> cameras = sixteen_cameras();
  for (int shares = 1; shares <= 17; ++shares) {
    std::vector<std::size_t> all;
    for (int share = 0; share < shares; ++share) {
      const auto part = share_of_views(cameras, share, shares);
      EXPECT_NEAR(static_cast<double>(part.size()), 16.0 / shares, 1);
      EXPECT_TRUE(std::is_sorted(part.begin(), part.end()));
      all.insert(all.end(), part.begin(), part.end());
    }
    std::sort(all.begin(), all.end());
    std::vector<std::size_t> expected(16);
    std::iota(expected.begin(), expected.end(), std::size_t{0});
    EXPECT_EQ(all, expected);
  }
}

TEST(ShareViews, Shares_AreAdjacentWhateverTheCameraOrder) {
  std::vector<Camera> cameras = sixteen_cameras();
  std::vector<Camera> mixed;
  for (std::size_t i = 0; i < 16; ++i) {
    mixed.push_back(cameras[(i * 7) % 16]);
  }
  const auto widest = [](const std::vector<Camera>& rig, const std::vector<std::size_t>& share) {
    double angle = 0;
    for (const std::size_t a : share) {
      for (const std::size_t b : share) {
        const Eigen::Vector3d from = camera_center(rig[a]).cwiseProduct(Eigen::Vector3d(1, 0, 1));
        const Eigen::Vector3d to = camera_center(rig[b]).cwiseProduct(Eigen::Vector3d(1, 0, 1));
        angle = std::max(angle, std::acos(from.normalized().dot(to.normalized())));
      }
    }
    return angle;
  };
  for (int share = 0; share < 4; ++share) {
    EXPECT_LT(widest(mixed, share_of_views(mixed, share, 4)), 1.5);  // a quarter of the circle
  }
}

TEST(ShareViews, AdjacentShares_ComputeFewerViewsThanStrided) {
  const std::vector<Camera> cameras = sixteen_cameras();
  const auto sources = choose_sources(cameras, looked_at(cameras), 3);
  for (const int shares : {2, 4}) {
    std::vector<std::vector<std::size_t>> neighbours(static_cast<std::size_t>(shares));
    std::vector<std::vector<std::size_t>> every_nth(static_cast<std::size_t>(shares));
    for (int share = 0; share < shares; ++share) {
      neighbours[static_cast<std::size_t>(share)] = share_of_views(cameras, share, shares);
    }
    for (std::size_t view = 0; view < cameras.size(); ++view) {
      every_nth[view % static_cast<std::size_t>(shares)].push_back(view);
    }
    const std::size_t ours = computed(neighbours, sources);
    const std::size_t theirs = computed(every_nth, sources);
    std::printf("%d machines compute %zu views side by side, %zu if each takes every n-th\n",
                shares, ours, theirs);
    EXPECT_LE(4 * ours, 3 * theirs) << shares;
    EXPECT_LT(ours, 16 * static_cast<std::size_t>(shares)) << shares;
  }
}

TEST(ShareViews, SourceViews_AreAddedOnce) {
  EXPECT_THAT(with_sources({1}, {{1, 2}, {0, 2}, {1}}), ElementsAre(0, 1, 2));
  EXPECT_THAT(with_sources({0, 2}, {{2}, {0}, {0}}), ElementsAre(0, 2));
  EXPECT_THAT(with_sources({}, {{1}, {0}}), ElementsAre());
}

TEST(ShareViews, ShareOrViewOutOfRange_IsRefused) {
  const std::vector<Camera> cameras = sixteen_cameras();
  EXPECT_THROW(share_of_views(cameras, 4, 4), LogicError);
  EXPECT_THROW(share_of_views(cameras, -1, 4), LogicError);
  EXPECT_THROW(with_sources({2}, {{1}, {0}}), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
