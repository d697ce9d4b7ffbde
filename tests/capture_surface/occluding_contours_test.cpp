#include "capture/surface/occluding_contours.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr double kLimbRadius = 0.05;  // m, of the limb in the images
constexpr double kLimbHeight = 0.4;   // m
constexpr int kLimbViews = 8;
constexpr double kEroded = 1;  // px, by which masks are smaller than the limb

/// A limb about the y axis as a scan has it, of another radius.
Mesh limb(double radius) {
  Mesh mesh = fixtures::tube(32, 40, 1);
  mesh.vertices.col(0) *= radius;
  mesh.vertices.col(2) *= radius;
  mesh.vertices.col(1) = kLimbHeight * (mesh.vertices.col(1).array() - 0.5);
  return mesh;
}

/// Cameras around the limb at a metre, 2 mm a pixel, and what they see of it.
struct LimbViews {
  std::vector<Camera> cameras;
  std::vector<Image> images;
  std::vector<ByteImage> masks;

  explicit LimbViews(float skin = 0.6F) {
    for (int i = 0; i < kLimbViews; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.1) / kLimbViews;
      const Eigen::Vector3d forward(-std::sin(angle), 0, -std::cos(angle));
      const Eigen::Vector3d right = Eigen::Vector3d(0, -1, 0).cross(forward);
      Camera camera;
      camera.width = 120;
      camera.height = 240;
      camera.fx = camera.fy = 500;
      camera.cx = 60;
      camera.cy = 120;
      camera.camera_from_world_rotation << right.transpose(), 0, -1, 0, forward.transpose();
      camera.camera_from_world_translation = Eigen::Vector3d(0, 0, 1);
      // Rays that touch the limb: sin of their angle is its radius.
      const double edge = 500 * kLimbRadius / std::sqrt(1 - kLimbRadius * kLimbRadius);
      Image image(camera.width, camera.height, 3, 0.2F);
      ByteImage mask(camera.width, camera.height, 1);
      for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
          const double beyond = std::abs(x + 0.5 - camera.cx) - edge;
          const auto share = static_cast<float>(std::clamp(0.5 - beyond, 0.0, 1.0));
          for (int c = 0; c < 3; ++c) {
            image.at(x, y, c) += share * (skin - 0.2F);
          }
          mask.at(x, y) = beyond < -kEroded ? 255 : 0;
        }
      }
      cameras.push_back(camera);
      images.push_back(std::move(image));
      masks.push_back(std::move(mask));
    }
  }
};

std::vector<std::uint8_t> all_of(const Mesh& mesh) {
  return std::vector<std::uint8_t>(static_cast<std::size_t>(mesh.vertices.rows()), 1);
}

Mesh moved(const Mesh& mesh, const LimbViews& views, const ContourOptions& options = {}) {
  return moved_to_contours(mesh, views.cameras, views.images, views.masks, all_of(mesh), options);
}

double mean_radius(const Mesh& mesh) {
  return mesh.vertices(Eigen::all, {0, 2}).rowwise().norm().mean();
}

TEST(OccludingContours, TooThinLimb_GrowsToItsOutline) {
  const Mesh found = moved(limb(kLimbRadius - 0.003), LimbViews());
  EXPECT_NEAR(mean_radius(found), kLimbRadius, 2e-4);
  EXPECT_LT(
      (found.vertices(Eigen::all, {0, 2}).rowwise().norm().array() - kLimbRadius).abs().maxCoeff(),
      6e-4);
}

TEST(OccludingContours, TooThickLimb_ShrinksToItsOutline) {
  EXPECT_NEAR(mean_radius(moved(limb(kLimbRadius + 0.003), LimbViews())), kLimbRadius, 2e-4);
}

TEST(OccludingContours, CorrectLimb_StaysUnchanged) {
  EXPECT_NEAR(mean_radius(moved(limb(kLimbRadius), LimbViews())), kLimbRadius, 2e-4);
}

TEST(OccludingContours, MiscalibratedView_IsAnOutlier) {
  LimbViews views;
  views.cameras[3].cx += 5;
  EXPECT_NEAR(mean_radius(moved(limb(kLimbRadius - 0.003), views)), kLimbRadius, 5e-4);
}

TEST(OccludingContours, FixedVertices_StayBitExact) {
  const Mesh thin = limb(kLimbRadius - 0.003);
  std::vector<std::uint8_t> movable = all_of(thin);
  for (Index v = 0; v < thin.vertices.rows(); ++v) {
    movable[static_cast<std::size_t>(v)] = thin.vertices(v, 1) > 0 ? 1 : 0;
  }
  const LimbViews views;
  const Mesh found = moved_to_contours(thin, views.cameras, views.images, views.masks, movable);
  for (Index v = 0; v < thin.vertices.rows(); ++v) {
    const double radius = found.vertices.row(v)({0, 2}).norm();
    if (movable[static_cast<std::size_t>(v)] == 0) {
      EXPECT_EQ(found.vertices.row(v), thin.vertices.row(v));
    } else {
      EXPECT_NEAR(radius, kLimbRadius, 6e-4) << v;
    }
  }
}

TEST(OccludingContours, NoVisibleContour_MovesNothing) {
  const Mesh thin = limb(kLimbRadius - 0.003);
  const LimbViews alike(0.2F);  // skin as bright as the background
  EXPECT_EQ(moved(thin, alike).vertices, thin.vertices);
  LimbViews blind;
  blind.masks.assign(kLimbViews, {});
  EXPECT_EQ(moved(thin, blind).vertices, thin.vertices);
  LimbViews crowded;  // somebody is everywhere
  for (ByteImage& mask : crowded.masks) {
    std::fill(mask.data.begin(), mask.data.end(), std::uint8_t{255});
  }
  EXPECT_EQ(moved(thin, crowded).vertices, thin.vertices);
  EXPECT_EQ(moved(thin, LimbViews(), {.fit = false}).vertices, thin.vertices);
  EXPECT_EQ(moved(Mesh{}, LimbViews()).vertices.rows(), 0);
}

TEST(OccludingContours, OccludedContours_MoveNothing) {
  Mesh thin = limb(kLimbRadius - 0.003);
  const Mesh wall = limb(kLimbRadius + 0.02);  // around it, cut nowhere
  const Index first = thin.vertices.rows();
  Mesh both;
  both.vertices.resize(2 * first, 3);
  both.vertices << thin.vertices, wall.vertices;
  both.faces.resize(2 * thin.faces.rows(), 3);
  both.faces << thin.faces, wall.faces.array() + static_cast<int>(first);
  std::vector<std::uint8_t> movable = all_of(both);
  std::fill(movable.begin() + first, movable.end(), std::uint8_t{0});
  const LimbViews views;
  const Mesh found = moved_to_contours(both, views.cameras, views.images, views.masks, movable);
  EXPECT_EQ(found.vertices, both.vertices);
}

TEST(OccludingContours, AnyThreadCount_GivesTheSameBits) {
  const LimbViews views;
  const Mesh thin = limb(kLimbRadius - 0.003);
  const Mesh many = moved(thin, views);
  set_thread_count(1);
  const Mesh one = moved(thin, views);
  set_thread_count(0);
  EXPECT_EQ(many.vertices, one.vertices);
}

TEST(OccludingContours, VertexAttributes_AreKept) {
  Mesh thin = limb(kLimbRadius - 0.003);
  thin.colors = thin.vertices.cast<float>();
  thin.confidence = thin.vertices.col(1).cast<float>();
  thin.labels.assign(static_cast<std::size_t>(thin.vertices.rows()), 1);
  const Mesh found = moved(thin, LimbViews());
  EXPECT_EQ(found.colors, thin.colors);
  EXPECT_EQ(found.confidence, thin.confidence);
  EXPECT_EQ(found.labels, thin.labels);
  EXPECT_EQ(found.faces, thin.faces);
}

TEST(OccludingContours, MismatchedSizes_AreRefused) {
  const Mesh mesh = limb(kLimbRadius);
  LimbViews views;
  ATELIER_EXPECT_REFUSED(moved_to_contours(mesh, views.cameras, views.images, views.masks, {1, 1}),
                         LogicError, "every vertex moves or not");
  LimbViews fewer = views;
  fewer.images.pop_back();
  ATELIER_EXPECT_REFUSED(moved(mesh, fewer), LogicError, "an image and a mask for each camera");
  LimbViews small = views;
  small.masks[0] = ByteImage(10, 10, 1, 255);
  ATELIER_EXPECT_REFUSED(moved(mesh, small), LogicError, "of another size");
  LimbViews grey = views;
  grey.images[0] = Image(120, 240, 1);
  ATELIER_EXPECT_REFUSED(moved(mesh, grey), LogicError, "of another size");
}

}  // namespace
}  // namespace atelier
