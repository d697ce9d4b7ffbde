#include "appearance/surface_frame.h"

#include <Eigen/Geometry>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/joined_surfaces.h"
#include "appearance/visible_pixels.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// The plane y = 0 over [0,1]^2 with u along x and v against z.
Mesh sheet() {
  Mesh mesh = fixtures::grid(4, 4);
  mesh.uvs.resize(mesh.vertices.rows(), 2);
  mesh.uvs.col(0) = mesh.vertices.col(0);
  mesh.uvs.col(1) = 1 - mesh.vertices.col(2).array();
  mesh.uv_faces = mesh.faces;
  return mesh;
}

SurfaceFrame frame_of(const Mesh& mesh) {
  return surface_frame(mesh.vertices, mesh.faces, mesh.uvs, mesh.uv_faces);
}

TEST(SurfaceFrame, Plane_HasPositionNormalAndTangent) {
  const Mesh mesh = sheet();
  const SurfaceFrame frame = frame_of(mesh);
  const TexelMap texels = texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 16);
  ASSERT_EQ(texels.covered.size(), 256U);
  const Eigen::MatrixXf position = texel_values(texels, mesh.faces, frame.position);
  const Eigen::MatrixXf normal = texel_values(texels, mesh.faces, frame.normal);
  const Eigen::MatrixXf tangent = texel_values(texels, mesh.uv_faces, frame.tangent);
  for (Index i = 0; i < 256; ++i) {
    const int texel = texels.covered[static_cast<std::size_t>(i)];
    const Eigen::RowVector3f place((texel % 16 + 0.5F) / 16, 0, (texel / 16 + 0.5F) / 16);
    EXPECT_LT((position.row(i) - place).norm(), 1e-3F);
    EXPECT_LT((normal.row(i) - Eigen::RowVector3f(0, 1, 0)).norm(), 1e-6F);
    EXPECT_LT((tangent.row(i) - Eigen::RowVector3f(1, 0, 0)).norm(), 1e-6F);
  }
}

TEST(SurfaceFrame, RotatedSurface_RotatesTheFrame) {
  Mesh mesh = sheet();
  mesh.vertices.col(1) = 0.2 * (5 * mesh.vertices.col(0).array()).sin();
  const SurfaceFrame before = frame_of(mesh);
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  mesh.vertices = (mesh.vertices * turn.transpose()).eval();
  const SurfaceFrame after = frame_of(mesh);
  const Eigen::Matrix3f turned = turn.cast<float>().transpose();
  EXPECT_LT((after.normal - before.normal * turned).cwiseAbs().maxCoeff(), 1e-5F);
  EXPECT_LT((after.tangent - before.tangent * turned).cwiseAbs().maxCoeff(), 1e-5F);
}

TEST(SurfaceFrame, MirroredCharts_KeepTheDirectionOfGrowingU) {
  Mesh mesh = sheet();
  mesh.uvs.col(0) = 1 - mesh.uvs.col(0).array();
  EXPECT_LT((frame_of(mesh).tangent.row(7) - Eigen::RowVector3f(-1, 0, 0)).norm(), 1e-6F);
}

TEST(SurfaceFrame, TexelsBesideAChart_AreFilled) {
  Mesh mesh = sheet();
  mesh.uvs = 0.25 + 0.5 * mesh.uvs.array();
  const TexelMap texels = texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 32);
  const Image normal = texture_of(texels, texel_values(texels, mesh.faces, frame_of(mesh).normal));
  EXPECT_EQ(normal.at(16, 16, 1), 1.0F);
  EXPECT_EQ(normal.at(7, 16, 1), 1.0F);  // one texel outside
  EXPECT_EQ(normal.at(1, 16, 1), 0.0F);  // far outside
}

Camera from_above() {
  Camera camera;
  camera.id = "above";
  camera.width = camera.height = 64;
  camera.fx = camera.fy = 64;
  camera.cx = camera.cy = 32;
  camera.camera_from_world_rotation << 1, 0, 0, 0, 0, 1, 0, -1,
      0;  // looks down, z of the world down
  camera.camera_from_world_translation = {-0.5, -0.5, 2};
  return camera;
}

TEST(JoinedSurfaces, SeveralSurfaces_KeepTheirOrder) {
  const Mesh cloth = sheet();
  const Mesh ball = fixtures::sphere(0);
  const JoinedSurfaces all =
      joined_surfaces({{&ball.vertices, &ball.faces}, {&cloth.vertices, &cloth.faces}});
  EXPECT_EQ(all.first_face, (std::vector<int>{0, 8, 8 + static_cast<int>(cloth.faces.rows())}));
  EXPECT_EQ(all.vertices.bottomRows(cloth.vertices.rows()), cloth.vertices);
  EXPECT_EQ(all.faces.bottomRows(cloth.faces.rows()), Triangles(cloth.faces.array() + 6));
}

TEST(VisiblePixels, RasterizedPixels_HaveTextureCoordinatesAndOcclusion) {
  const Mesh cloth = sheet();
  Mesh lid = fixtures::grid(1, 1);
  lid.vertices.col(0) *= 0.5;
  lid.vertices.col(1).array() += 0.5;  // hides a little more than the left half
  const JoinedSurfaces all =
      joined_surfaces({{&lid.vertices, &lid.faces}, {&cloth.vertices, &cloth.faces}});
  const VisiblePixels pixels = visible_pixels(rasterize(all.vertices, all.faces, from_above()),
                                              all.first_face[1], cloth.uvs, cloth.uv_faces);
  ASSERT_GT(pixels.pixel.size(), 300U);
  int trusted = 0;
  for (std::size_t i = 0; i < pixels.pixel.size(); ++i) {
    const double x = pixels.pixel[i] % 64 + 0.5;
    const double y = pixels.pixel[i] / 64 + 0.5;
    // The plane is 2 m away: a pixel is 1/32 m.
    EXPECT_NEAR(pixels.u[i], 0.5 + (x - 32) / 32, 1e-3);
    EXPECT_NEAR(pixels.v[i], 1 - (0.5 + (y - 32) / 32), 1e-3);
    EXPECT_NEAR(pixels.depth[i], 2, 1e-5);
    EXPECT_GT(pixels.u[i], 0.5 - 1.0 / 32);
    trusted += pixels.trusted[i];
    if (pixels.trusted[i] != 0) {
      EXPECT_GT(pixels.u[i], 0.5 + 1.0 / 32);
      EXPECT_LT(pixels.u[i], 1 - 2.0 / 32);
    }
  }
  EXPECT_GT(trusted, 200);
}

TEST(SurfaceFrameRefused, MismatchedInput_IsRefused) {
  const Mesh mesh = sheet();
  const TexelMap texels = texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 8);
  const Triangles fewer = mesh.faces.topRows(3);
  const SurfaceFrame frame = frame_of(mesh);
  ATELIER_EXPECT_REFUSED(surface_frame(mesh.vertices, fewer, mesh.uvs, mesh.uv_faces), LogicError,
                         "differ");
  ATELIER_EXPECT_REFUSED(surface_frame(Points(2, 3), mesh.faces, mesh.uvs, mesh.uv_faces),
                         LogicError, "vertex that is not there");
  ATELIER_EXPECT_REFUSED(surface_frame(mesh.vertices, mesh.faces, Points2(2, 2), mesh.uv_faces),
                         LogicError, "coordinate that is not there");
  ATELIER_EXPECT_REFUSED(texel_values(texels, fewer, frame.position), LogicError, "of other faces");
  ATELIER_EXPECT_REFUSED(texel_values(texels, mesh.faces, frame.position.topRows(2)), LogicError,
                         "row that is not there");
  ATELIER_EXPECT_REFUSED(texture_of(texels, Eigen::MatrixXf::Zero(3, 3)), LogicError,
                         "each covered texel");
  ATELIER_EXPECT_REFUSED(visible_pixels({}, -1, mesh.uvs, mesh.uv_faces), LogicError,
                         "not negative");
  ATELIER_EXPECT_REFUSED(joined_surfaces({{}}), LogicError, "has vertices and faces");
}

}  // namespace
}  // namespace atelier
