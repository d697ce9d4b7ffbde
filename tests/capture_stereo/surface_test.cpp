// From cameras and masks to bounds, from depth maps to points.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/stereo/choose_sources.h"
#include "capture/stereo/fuse.h"
#include "capture/stereo/undistort.h"
#include "capture/stereo/visual_hull.h"
#include "core/error.h"
#include "tests/capture_stereo/textured_ball.h"

namespace atelier::fixtures {
namespace {

/// Cameras all around, and the ball's masks in them.
struct Ring {
  std::vector<Camera> cameras;
  std::vector<ByteImage> masks;
  explicit Ring(int count, double radius = 0.3) {
    TexturedBall ball;
    ball.radius = radius;
    for (StereoView& view : ball.views(count, 6.283185307179586 / count, 120, 120)) {
      view.camera.fx *= 0.6;  // wide views, each of which has most of the hull in its image
      view.camera.fy *= 0.6;
      cameras.push_back(view.camera);
      ByteImage mask(120, 120, 1);
      for (int y = 0; y < 120; ++y) {
        for (int x = 0; x < 120; ++x) {
          mask.at(x, y) = ball.depth(view.camera, x + 0.5, y + 0.5) ? 1 : 0;
        }
      }
      masks.push_back(std::move(mask));
    }
  }
};

/// Maps that know the ball exactly.
std::vector<DepthMap> true_maps(const TexturedBall& ball, const std::vector<Camera>& cameras) {
  std::vector<DepthMap> maps;
  for (const Camera& camera : cameras) {
    DepthMap map;
    map.camera = camera;
    map.depth = Image(camera.width, camera.height, 1);
    map.normal = Image(camera.width, camera.height, 3);
    map.confidence = Image(camera.width, camera.height, 1);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const auto depth = ball.depth(camera, x + 0.5, y + 0.5);
        if (!depth) {
          continue;
        }
        map.depth.at(x, y) = static_cast<float>(*depth);
        map.confidence.at(x, y) = 0.9f;
        const Eigen::Vector3d normal =
            TexturedBall::place(camera, x + 0.5, y + 0.5, *depth).normalized();
        for (int k = 0; k < 3; ++k) {
          map.normal.at(x, y, k) = static_cast<float>(normal(k));
        }
      }
    }
    maps.push_back(std::move(map));
  }
  return maps;
}

double volume(const VisualHull& hull) {
  double count = 0;
  for (const std::uint8_t cell : hull.occupied) {
    count += cell;
  }
  return count * hull.voxel_size * hull.voxel_size * hull.voxel_size;
}

TEST(ChooseSources, NeighborsAt15Degrees_ComeFirst) {
  const Ring ring(24);
  const auto sources = choose_sources(ring.cameras, Eigen::Vector3d::Zero(), 4);
  EXPECT_THAT(sources[5], ::testing::UnorderedElementsAre(3, 4, 6, 7));
  EXPECT_TRUE(sources[5][0] == 4 || sources[5][0] == 6);
  EXPECT_THAT(sources[0], ::testing::UnorderedElementsAre(1, 2, 22, 23));
}

TEST(ChooseSources, CamerasBehindTheSubject_AreNotSources) {
  const Ring ring(3);  // 120 degrees apart
  for (const auto& sources : choose_sources(ring.cameras, Eigen::Vector3d::Zero(), 4)) {
    EXPECT_TRUE(sources.empty());
  }
}

TEST(LookedAt, LookedAtPoint_IsWhereTheAxesMeet) {
  EXPECT_LT(looked_at(Ring(5).cameras).norm(), 1e-9);
  const std::vector<Camera> one(1, Ring(5).cameras[0]);
  EXPECT_NEAR((looked_at(one) - camera_center(one[0])).norm(), 1, 1e-9);
}

TEST(VisualHull, BallMasks_GiveATightHull) {
  const Ring ring(16);
  const VisualHull hull = visual_hull(ring.cameras, ring.masks, {.voxel_size = 0.02});
  const double ball = 4.0 / 3 * 3.14159265 * 0.027;
  EXPECT_GT(volume(hull), ball);
  EXPECT_LT(volume(hull), 1.9 * ball);  // cameras are all near one height: caps stay
  Random random{3, 0, 0};
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3d p(normal(random), normal(random), normal(random));
    p *= 0.299 / p.norm();
    const Eigen::Vector3i cell = ((p - hull.origin) / hull.voxel_size).array().floor().cast<int>();
    ASSERT_TRUE(hull.at(cell.x(), cell.y(), cell.z()));
  }
}

TEST(VisualHull, OneWrongMask_CanBeTolerated) {
  Ring ring(16);
  for (std::uint8_t& pixel : ring.masks[3].data) {
    pixel = 1 - pixel;  // inverted
  }
  const double right = volume(visual_hull(Ring(16).cameras, Ring(16).masks, {.voxel_size = 0.03}));
  EXPECT_LT(volume(visual_hull(ring.cameras, ring.masks, {.voxel_size = 0.03})), 0.5 * right);
  EXPECT_GT(volume(visual_hull(ring.cameras, ring.masks, {.voxel_size = 0.03, .tolerated = 1})),
            0.9 * right);
}

TEST(VisualHull, EmptyMasks_GiveAnEmptyHull) {
  Ring ring(6);
  for (ByteImage& mask : ring.masks) {
    std::fill(mask.data.begin(), mask.data.end(), std::uint8_t{0});
  }
  EXPECT_EQ(volume(visual_hull(ring.cameras, ring.masks)), 0);
}

TEST(VisualHull, MasksOfOtherSize_AreRefused) {
  Ring ring(4);
  ring.masks[2] = ByteImage(10, 10, 1);
  EXPECT_THROW(visual_hull(ring.cameras, ring.masks), LogicError);
  ring.masks.pop_back();
  EXPECT_THROW(visual_hull(ring.cameras, ring.masks), LogicError);
}

TEST(DepthBounds, DepthBounds_EncloseTheTrueDepth) {
  const Ring ring(16);
  const TexturedBall ball;
  const VisualHull hull = visual_hull(ring.cameras, ring.masks, {.voxel_size = 0.02});
  const DepthBounds bounds = depth_bounds(hull, ring.cameras[2], ring.masks[2]);
  int looked = 0;
  int close = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 120; ++x) {
      const auto depth = ball.depth(ring.cameras[2], x + 0.5, y + 0.5);
      ASSERT_EQ(bounds.near_depth.at(x, y) > 0, depth.has_value());
      if (depth) {
        ++looked;
        ASSERT_LE(bounds.near_depth.at(x, y), *depth);
        ASSERT_GE(bounds.far_depth.at(x, y), *depth);
        close += bounds.near_depth.at(x, y) > *depth - 0.1 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(looked, 1000);
  EXPECT_GT(close, looked * 2 / 3);
}

TEST(Fuse, FusedPoints_LieOnTheBall) {
  const Ring ring(16);
  const TexturedBall ball;
  const Mesh points = fuse(true_maps(ball, ring.cameras), {});
  ASSERT_GT(points.vertices.rows(), 3000);
  EXPECT_EQ(points.colors.rows(), 0);
  for (Index i = 0; i < points.vertices.rows(); ++i) {
    ASSERT_NEAR(points.vertices.row(i).norm(), 0.3, 0.001);
    ASSERT_GT(points.normals.row(i).dot(points.vertices.row(i)) / 0.3, 0.98);
    ASSERT_GT(points.confidence(i), 0.5);
  }
}

TEST(Fuse, DepthSeenByOneViewOnly_IsLeftOut) {
  const Ring ring(16);
  const TexturedBall ball;
  auto maps = true_maps(ball, ring.cameras);
  for (float& depth : maps[0].depth.data) {
    depth *= 0.8f;
  }
  const Mesh points = fuse(maps, {});
  EXPECT_NEAR(points.vertices.rowwise().norm().maxCoeff(), 0.3, 0.001);
}

TEST(Fuse, PointColors_AreMeansOfTheViews) {
  const Ring ring(16);
  std::vector<Image> images(16, Image(120, 120, 3, 0.25f));
  const Mesh points = fuse(true_maps(TexturedBall(), ring.cameras), images);
  ASSERT_EQ(points.colors.rows(), points.vertices.rows());
  EXPECT_NEAR(points.colors.minCoeff(), 0.25, 1e-6);
  EXPECT_NEAR(points.colors.maxCoeff(), 0.25, 1e-6);
}

TEST(Fuse, ImagesOfOtherSize_AreRefused) {
  const auto maps = true_maps(TexturedBall(), Ring(3).cameras);
  EXPECT_THROW(fuse(maps, {Image(120, 120, 3)}), LogicError);
  EXPECT_THROW(fuse(maps, std::vector<Image>(3, Image(60, 120, 3))), LogicError);
}

TEST(Undistorted, UndistortedImage_MatchesPinholeCamera) {
  Camera camera = Ring(3).cameras[0];
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.2, 0.05, 0.001, -0.002};
  // An image whose value is a linear function of the direction.
  Image image(camera.width, camera.height, 2);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto direction = ray_direction(camera, {x + 0.5, y + 0.5});
      const Eigen::Vector3d ray = camera.camera_from_world_rotation * *direction;
      image.at(x, y, 0) = static_cast<float>(ray.x() / ray.z());
      image.at(x, y, 1) = static_cast<float>(ray.y() / ray.z());
    }
  }
  const Image straight = undistorted(camera, image);
  for (int y = 20; y < 100; ++y) {
    for (int x = 20; x < 100; ++x) {
      ASSERT_NEAR(straight.at(x, y, 0), (x + 0.5 - camera.cx) / camera.fx, 2e-5);
      ASSERT_NEAR(straight.at(x, y, 1), (y + 0.5 - camera.cy) / camera.fy, 2e-5);
    }
  }
}

TEST(Undistorted, ImageOfOtherSize_IsRefused) {
  const Camera camera = Ring(3).cameras[0];
  EXPECT_THROW(undistorted(camera, Image(3, 3, 1)), LogicError);
  EXPECT_THROW(undistorted(camera, ByteImage(3, 3, 1)), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
