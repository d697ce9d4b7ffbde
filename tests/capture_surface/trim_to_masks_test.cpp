#include "capture/surface/trim_to_masks.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

constexpr double kHem = 0.103;  // m, where the masks say that the sheet ends

/// A sheet of 0.4 x 0.4 m with edges of 1 cm about the origin, facing +z, with every attribute.
Mesh sheet() {
  constexpr int kSide = 41;
  Mesh mesh;
  mesh.vertices.resize(kSide * kSide, 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      mesh.vertices.row(y * kSide + x) << 0.01 * x - 0.2, 0.01 * y - 0.2, 0;
    }
  }
  std::vector<Eigen::RowVector3i> faces;
  for (int y = 0; y + 1 < kSide; ++y) {
    for (int x = 0; x + 1 < kSide; ++x) {
      const int a = y * kSide + x;
      faces.emplace_back(a, a + 1, a + kSide);
      faces.emplace_back(a + 1, a + kSide + 1, a + kSide);
    }
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    mesh.faces.row(static_cast<Index>(f)) = faces[f];
  }
  mesh.colors = mesh.vertices.cast<float>().array() + 0.5F;
  mesh.confidence = mesh.vertices.col(1).cast<float>();
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    mesh.labels.push_back(mesh.vertices(v, 1) > 0 ? 3 : 4);
  }
  return mesh;
}

/// Cameras 2 m off along `z`, side by side, that look along the z axis.
struct Views {
  std::vector<Camera> cameras;
  std::vector<ByteImage> masks;

  /// @param hem  m, below which each view's mask says that the subject is
  explicit Views(const std::vector<double>& hem, double z = 2) {
    for (std::size_t i = 0; i < hem.size(); ++i) {
      Camera camera;
      camera.width = camera.height = 400;
      camera.fx = camera.fy = 1000;
      camera.cx = camera.cy = 200;
      const Eigen::Vector3d centre(0.1 * static_cast<double>(i) - 0.1, 0, z);
      const Eigen::Vector3d forward(0, 0, z > 0 ? -1 : 1);
      const Eigen::Vector3d right = Eigen::Vector3d(0, -1, 0).cross(forward);
      camera.camera_from_world_rotation << right.transpose(), forward.cross(right).transpose(),
          forward.transpose();
      camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
      ByteImage mask(camera.width, camera.height, 1);
      for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
          mask.at(x, y) = 0.002 * (200 - y - 0.5) < hem[i] ? 255 : 0;
        }
      }
      cameras.push_back(camera);
      masks.push_back(std::move(mask));
    }
  }
};

TEST(TrimToMasks, ASurfaceEndsWhereTheMasksEnd) {
  const Views views({kHem, kHem + 0.004, kHem - 0.004});
  const Mesh trimmed = trimmed_to_masks(sheet(), views.cameras, views.masks);
  check_mesh(trimmed);
  EXPECT_NEAR(trimmed.vertices.col(1).maxCoeff(), kHem, 0.0101);
  EXPECT_EQ(trimmed.vertices.col(1).minCoeff(), -0.2);
  ASSERT_EQ(trimmed.colors.rows(), trimmed.vertices.rows());
  for (Index v = 0; v < trimmed.vertices.rows(); ++v) {
    EXPECT_EQ(trimmed.labels[static_cast<std::size_t>(v)], trimmed.vertices(v, 1) > 0 ? 3 : 4);
    EXPECT_FLOAT_EQ(trimmed.confidence[v], static_cast<float>(trimmed.vertices(v, 1)));
    EXPECT_FLOAT_EQ(trimmed.colors(v, 0), static_cast<float>(trimmed.vertices(v, 0)) + 0.5F);
  }
}

TEST(TrimToMasks, OneMaskThatIsWrongIsOutvoted) {
  for (const double wrong : {-1.0, 1.0}) {
    const Views views({kHem, wrong, kHem});
    const Mesh trimmed = trimmed_to_masks(sheet(), views.cameras, views.masks);
    EXPECT_NEAR(trimmed.vertices.col(1).maxCoeff(), kHem, 0.02);
    EXPECT_EQ(trimmed.vertices.col(1).minCoeff(), -0.2);
  }
}

TEST(TrimToMasks, WhatNobodySeesStays) {
  const Mesh mesh = sheet();
  const Views behind({kHem, kHem}, -2);
  EXPECT_EQ(trimmed_to_masks(mesh, behind.cameras, behind.masks).faces.rows(), mesh.faces.rows());
  const Views views({kHem});
  EXPECT_EQ(trimmed_to_masks(mesh, views.cameras, {ByteImage{}}).faces.rows(), mesh.faces.rows());
  EXPECT_EQ(trimmed_to_masks(Mesh{}, views.cameras, views.masks).faces.rows(), 0);
}

TEST(TrimToMasks, SizesThatDifferAreRefused) {
  Views views({kHem, kHem});
  ATELIER_EXPECT_REFUSED(trimmed_to_masks(sheet(), views.cameras, {ByteImage{}}), LogicError,
                         "a mask for each camera");
  views.masks[1] = ByteImage(10, 10, 1);
  ATELIER_EXPECT_REFUSED(trimmed_to_masks(sheet(), views.cameras, views.masks), LogicError,
                         "another size");
}

}  // namespace
}  // namespace atelier
