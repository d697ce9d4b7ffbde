#include "appearance/texel_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/packed_atlas.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A flat sheet of 1 m, cut down the middle into two charts that tile the same texture.
Mesh cut_sheet() {
  Mesh mesh = fixtures::grid(8, 8);
  mesh.uv_faces = mesh.faces;
  const Index count = mesh.vertices.rows();
  mesh.uvs.resize(2 * count, 2);
  for (Index v = 0; v < count; ++v) {
    const Eigen::RowVector2d flat(mesh.vertices(v, 0), 1 - mesh.vertices(v, 2));
    mesh.uvs.row(v) = flat;
    mesh.uvs.row(count + v) = 3 * (flat - Eigen::RowVector2d(0.5, 0));  // another scale and place
  }
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const double middle = (mesh.vertices(mesh.faces(f, 0), 0) + mesh.vertices(mesh.faces(f, 1), 0) +
                           mesh.vertices(mesh.faces(f, 2), 0)) /
                          3;
    if (middle > 0.5) {
      mesh.uv_faces.row(f).array() += static_cast<int>(count);
    }
  }
  return mesh;
}

/// Where in the world a covered texel lies.
Eigen::Vector3d place_of(const Mesh& mesh, const TexelMap& map, int texel) {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  const int face = map.face.data[static_cast<std::size_t>(texel)];
  for (int k = 0; k < 3; ++k) {
    place += static_cast<double>(map.barycentric.data[3 * static_cast<std::size_t>(texel) + k]) *
             mesh.vertices.row(mesh.faces(face, k)).transpose();
  }
  return place;
}

TEST(PackAtlas, Charts_KeepSurfaceScaleAndMargin) {
  const Mesh mesh = cut_sheet();
  const PackedAtlas atlas = pack_atlas(mesh, {.resolution = 64, .margin = 3});
  ASSERT_EQ(*std::max_element(atlas.chart.begin(), atlas.chart.end()), 1);
  EXPECT_GE(atlas.uvs.minCoeff(), 0);
  EXPECT_LE(atlas.uvs.maxCoeff(), 1);
  // The same length of surface is the same length of texture on both charts.
  double scale[2] = {0, 0};
  Eigen::RowVector2d low[2] = {{9, 9}, {9, 9}};
  Eigen::RowVector2d high[2] = {{-9, -9}, {-9, -9}};
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const int chart = atlas.chart[static_cast<std::size_t>(f)];
    const auto edge = [&](const auto& rows, const Triangles& faces) {
      return (rows.row(faces(f, 1)) - rows.row(faces(f, 0))).norm();
    };
    scale[chart] = edge(atlas.uvs, atlas.uv_faces) / edge(mesh.vertices, mesh.faces);
    for (int k = 0; k < 3; ++k) {
      low[chart] = low[chart].cwiseMin(atlas.uvs.row(atlas.uv_faces(f, k)));
      high[chart] = high[chart].cwiseMax(atlas.uvs.row(atlas.uv_faces(f, k)));
    }
  }
  EXPECT_NEAR(scale[0], scale[1], 1e-9);
  EXPECT_GT(scale[0], 0.7);  // half a square metre each: nearly all of the square is used
  const double gap = std::max((low[1] - high[0]).maxCoeff(), (low[0] - high[1]).maxCoeff());
  EXPECT_GE(gap, 3.0 / 64 - 1e-9);
}

TEST(TexelMap, CoveredTexels_MatchTheirTextureCoordinates) {
  const Mesh mesh = cut_sheet();
  const PackedAtlas atlas = pack_atlas(mesh, {.resolution = 64});
  const TexelMap map = texel_map(mesh.faces, atlas.uvs, atlas.uv_faces, 64);
  ASSERT_GT(map.covered.size(), 64U * 64U * 6 / 10);
  for (const int texel : map.covered) {
    const int face = map.face.data[static_cast<std::size_t>(texel)];
    Eigen::Vector2d uv(0, 0);
    for (int k = 0; k < 3; ++k) {
      uv += static_cast<double>(map.barycentric.data[3 * static_cast<std::size_t>(texel) + k]) *
            atlas.uvs.row(atlas.uv_faces(face, k)).transpose();
    }
    EXPECT_NEAR(uv.x(), (texel % 64 + 0.5) / 64, 1e-4);
    EXPECT_NEAR(uv.y(), 1 - (texel / 64 + 0.5) / 64, 1e-4);
    EXPECT_EQ(map.source[static_cast<std::size_t>(texel)], texel);
  }
}

TEST(TexelMap, TextureBesideASeam_ContinuesTheSurface) {
  const Mesh mesh = cut_sheet();
  const PackedAtlas atlas = pack_atlas(mesh, {.resolution = 64, .margin = 4});
  const TexelMap map = texel_map(mesh.faces, atlas.uvs, atlas.uv_faces, 64, 2);
  // The flat sheet's place as a function of the texture coordinate of the first chart, to be
  // continued beyond the chart's edge.
  const double texel_size = [&] {
    const int a = map.covered[0];
    return (place_of(mesh, map, a) - place_of(mesh, map, a + 1)).norm();
  }();
  int beside_seam = 0;
  for (int y = 1; y < 63; ++y) {
    for (int x = 1; x < 62; ++x) {
      const int texel = y * 64 + x;
      const int from = map.source[static_cast<std::size_t>(texel)];
      if (map.face.at(x, y) < 0 && from != texel && map.face.at(x - 1, y) >= 0) {
        // Right of a covered texel: its surface lies one texel further along.
        const Eigen::Vector3d left = place_of(mesh, map, texel - 1);
        const Eigen::Vector3d here = place_of(mesh, map, from);
        if (std::abs(left.x() - 0.5) < 2 * texel_size && left.z() > 0.1 && left.z() < 0.9) {
          ++beside_seam;
          EXPECT_NEAR(here.x(), left.x() + texel_size, 1.01 * texel_size);
          EXPECT_GE(here.x(), 0.5 - 1e-6);
          EXPECT_NEAR(here.z(), left.z(), 1.01 * texel_size);
        }
      }
    }
  }
  EXPECT_GT(beside_seam, 20);
}

TEST(TexelMapRefused, BadAtlas_IsRefused) {
  Mesh mesh = cut_sheet();
  ATELIER_EXPECT_REFUSED(texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 64), DataError,
                         "outside of [0, 1]");
  ATELIER_EXPECT_REFUSED(texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 2), LogicError,
                         "4 to 8192");
  const Points2 none(0, 2);
  ATELIER_EXPECT_REFUSED(texel_map(mesh.faces, none, mesh.uv_faces, 64), LogicError,
                         "a coordinate that is not there");
  mesh.uvs.setZero();
  ATELIER_EXPECT_REFUSED(pack_atlas(mesh), DataError, "no area");
  mesh.uv_faces.resize(0, 3);
  ATELIER_EXPECT_REFUSED(pack_atlas(mesh), DataError, "with texture coordinates");
}

}  // namespace
}  // namespace atelier
