#include "capture/surface/trim_to_views.h"

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

TEST(TrimToViews, Surface_EndsWhereTheMasksEnd) {
  const Views views({kHem, kHem + 0.004, kHem - 0.004});
  const Mesh trimmed = trimmed_to_views(sheet(), views.cameras, views.masks);
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

TEST(TrimToViews, OneWrongMask_IsOutvoted) {
  for (const double wrong : {-1.0, 1.0}) {
    const Views views({kHem, wrong, kHem});
    const Mesh trimmed = trimmed_to_views(sheet(), views.cameras, views.masks);
    EXPECT_NEAR(trimmed.vertices.col(1).maxCoeff(), kHem, 0.02);
    EXPECT_EQ(trimmed.vertices.col(1).minCoeff(), -0.2);
  }
}

/// The depth of a sheet at z = 0 above `hem`, and of what lies `behind` it below: a sheet that goes
/// on farther is looked past there.
std::vector<DepthMap> depths(const Views& views, double hem, double behind) {
  std::vector<DepthMap> maps;
  for (const Camera& camera : views.cameras) {
    DepthMap map{camera, Image(camera.width, camera.height, 1),
                 Image(camera.width, camera.height, 3), Image(camera.width, camera.height, 1)};
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const bool sheet = 0.002 * (200 - y - 0.5) < hem;
        map.depth.at(x, y) = static_cast<float>(sheet ? 2 : 2 + behind);
        map.confidence.at(x, y) = 0.5F;
      }
    }
    maps.push_back(std::move(map));
  }
  return maps;
}

// Below the hem of a skirt masks show the subject still: its own inside.
TEST(TrimToViews, Surface_EndsWhereViewsSeePastIt) {
  const Views views({1, 1, 1});
  const auto end = [&](double behind, double min_confidence) {
    return trimmed_to_views(sheet(), views.cameras, views.masks, depths(views, kHem, behind),
                            min_confidence)
        .vertices.col(1)
        .maxCoeff();
  };
  EXPECT_NEAR(end(0.1, 0.1), kHem, 0.0101);
  EXPECT_EQ(end(0.01, 0.1), 0.2);  // as far as depths are off
  EXPECT_EQ(end(0.1, 0.6), 0.2);   // nobody is sure
}

TEST(TrimToViews, UnseenSurface_StaysUnchanged) {
  const Mesh mesh = sheet();
  const Views behind({kHem, kHem}, -2);
  EXPECT_EQ(trimmed_to_views(mesh, behind.cameras, behind.masks).faces.rows(), mesh.faces.rows());
  const Views views({kHem});
  EXPECT_EQ(trimmed_to_views(mesh, views.cameras, {ByteImage{}}).faces.rows(), mesh.faces.rows());
  EXPECT_EQ(trimmed_to_views(Mesh{}, views.cameras, views.masks).faces.rows(), 0);
}

TEST(TrimToViews, MismatchedSizes_AreRefused) {
  Views views({kHem, kHem});
  ATELIER_EXPECT_REFUSED(trimmed_to_views(sheet(), views.cameras, {ByteImage{}}), LogicError,
                         "a mask for each camera");
  views.masks[1] = ByteImage(10, 10, 1);
  ATELIER_EXPECT_REFUSED(trimmed_to_views(sheet(), views.cameras, views.masks), LogicError,
                         "another size");
  views.masks[1] = views.masks[0];
  std::vector<DepthMap> maps = depths(views, kHem, 0.1);
  maps[0].depth = Image(10, 10, 1);
  ATELIER_EXPECT_REFUSED(trimmed_to_views(sheet(), views.cameras, views.masks, maps), LogicError,
                         "another size");
  maps.pop_back();
  ATELIER_EXPECT_REFUSED(trimmed_to_views(sheet(), views.cameras, views.masks, maps), LogicError,
                         "a depth map for each camera");
}

}  // namespace
}  // namespace atelier
