#include "appearance/fill_texture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/picture_similarity.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

/// A sheet of two charts, left and right half of its surface, with a gap between them in the
/// texture.
struct TwoCharts {
  Mesh mesh = fixtures::grid(2, 1);
  TexelMap map;
  TwoCharts() {
    mesh.uvs.resize(3 * mesh.faces.rows(), 2);
    mesh.uv_faces.resize(mesh.faces.rows(), 3);
    for (Index f = 0; f < mesh.faces.rows(); ++f) {
      const double middle = mesh.vertices(mesh.faces.row(f)[0], 0) +
                            mesh.vertices(mesh.faces.row(f)[1], 0) +
                            mesh.vertices(mesh.faces.row(f)[2], 0);
      for (int k = 0; k < 3; ++k) {
        const Index v = mesh.faces(f, k);
        // Charts of 0.3 wide; the right one moved away.
        const double x = mesh.vertices(v, 0);
        mesh.uvs.row(3 * f + k) << (middle < 1.5 ? 0.1 + 0.6 * x : 0.2 + 0.6 * x),
            0.9 - 0.8 * mesh.vertices(v, 2);
        mesh.uv_faces(f, k) = static_cast<int>(3 * f + k);
      }
    }
    map = texel_map(mesh.faces, mesh.uvs, mesh.uv_faces, 32);
  }
};

StaticTexture seen_at(const TexelMap& map, const std::vector<std::pair<int, float>>& texels) {
  StaticTexture texture;
  texture.texture = Image(map.resolution, map.resolution, 3);
  texture.seen = ImageOf<std::uint8_t>(map.resolution, map.resolution, 1);
  for (const auto& [texel, value] : texels) {
    texture.seen.data[static_cast<std::size_t>(texel)] = 1;
    for (int c = 0; c < 3; ++c) {
      texture.texture.data[3 * static_cast<std::size_t>(texel) + static_cast<std::size_t>(c)] =
          value;
    }
  }
  return texture;
}

TEST(FillUnseen, UnseenTexels_TakeNearestSeenTexelAcrossSeams) {
  const TwoCharts two;
  // Rows of 32: the left chart covers 3.2 to 12.8, the right one 16 to 25.6.
  StaticTexture texture = seen_at(two.map, {{16 * 32 + 4, 0.2F}, {16 * 32 + 12, 0.8F}});
  fill_unseen(texture, two.map);
  EXPECT_FLOAT_EQ(texture.texture.at(4, 20, 1), 0.2F);
  EXPECT_FLOAT_EQ(texture.texture.at(11, 16, 1), 0.8F);
  EXPECT_FLOAT_EQ(texture.texture.at(17, 16, 0), 0.8F);  // across the seam
  EXPECT_FLOAT_EQ(texture.texture.at(24, 16, 0), 0.8F);
  for (const int texel : two.map.covered) {
    EXPECT_GE(texture.texture.data[3 * static_cast<std::size_t>(texel)], 0.2F - 1e-6F);
    EXPECT_LE(texture.texture.data[3 * static_cast<std::size_t>(texel)], 0.8F + 1e-6F);
  }
}

TEST(FillUnseen, UnreachableTexels_TakeTheMean) {
  TwoCharts two;
  for (std::size_t i = 0; i < two.map.source.size(); ++i) {
    two.map.source[i] = static_cast<int>(i);  // as if nothing were sewn
  }
  StaticTexture texture = seen_at(two.map, {{16 * 32 + 4, 0.2F}, {16 * 32 + 12, 0.8F}});
  fill_unseen(texture, two.map);
  EXPECT_FLOAT_EQ(texture.texture.at(20, 16, 2), 0.5F);
}

TEST(FillUnseen, NothingSeen_StaysBlack) {
  const TwoCharts two;
  StaticTexture texture = seen_at(two.map, {});
  fill_unseen(texture, two.map);
  EXPECT_EQ(texture.texture.at(8, 16, 0), 0.0F);
}

TEST(FillUnseenRefused, OtherResolution_Throws) {
  const TwoCharts two;
  StaticTexture texture = seen_at(two.map, {});
  texture.texture = Image(8, 8, 3);
  ATELIER_EXPECT_REFUSED(fill_unseen(texture, two.map), LogicError, "another resolution");
}

TEST(StaticTexture, TexelsTouchedAtCornersOnly_AreNotSeen) {
  // Pixels at the middles of four texels, and one a twentieth of the way from texel (3, 3) on.
  TexturePixels pixels;
  for (const float x : {0.5F, 1.5F, 2.5F, 6.5F, 3.55F}) {
    pixels.u.push_back(x / 8);
    pixels.v.push_back(1 - (x == 3.55F ? x : 0.5F) / 8);
    pixels.colors.insert(pixels.colors.end(), 3, 0.5F);
  }
  const StaticTexture texture = static_texture(8, 1, {{0, &pixels}});
  EXPECT_EQ(texture.seen.at(3, 3), 1);
  EXPECT_EQ(texture.seen.at(4, 3), 0);
  EXPECT_EQ(texture.texture.at(4, 3, 0), 0.0F);
  EXPECT_NEAR(texture.texture.at(3, 3, 0), 0.5F, 0.06F);
}

TEST(StaticTexture, PixelsCoarserThanTexels_AreStillUsed) {
  // Every pixel lies between four texels: nobody has half of its colour from one.
  TexturePixels pixels;
  for (int i = 0; i < 16; ++i) {
    pixels.u.push_back(static_cast<float>(i % 4 * 2 + 1) / 8);
    pixels.v.push_back(static_cast<float>(i / 4 * 2 + 1) / 8);
    pixels.colors.insert(pixels.colors.end(), 3, 0.3F);
  }
  const StaticTexture texture = static_texture(8, 1, {{0, &pixels}});
  EXPECT_NEAR(texture.texture.at(5, 5, 1), 0.3F, 1e-3F);
}

Image waves(double phase) {
  Image image(24, 20, 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        image.at(x, y, c) = static_cast<float>(0.5 + 0.3 * std::sin(0.9 * x + 0.4 * y + c + phase));
      }
    }
  }
  return image;
}

TEST(StructuralSimilarity, IdenticalImages_GiveOneAndOthersLess) {
  const Image image = waves(0);
  const ByteImage all(24, 20, 1, 255);
  EXPECT_NEAR(structural_similarity(image, image, all), 1, 1e-12);
  EXPECT_LT(structural_similarity(image, waves(0.5), all), 0.95);
  EXPECT_LT(structural_similarity(image, waves(3.14), all), 0);  // what is bright is dark
}

TEST(StructuralSimilarity, FlatImages_GiveTheRatioOfTheirMeans) {
  const ByteImage all(24, 20, 1, 1);
  const double expected = (2 * 0.2 * 0.6 + 1e-4) / (0.04 + 0.36 + 1e-4);
  EXPECT_NEAR(structural_similarity(Image(24, 20, 3, 0.2F), Image(24, 20, 3, 0.6F), all), expected,
              1e-5);
}

TEST(StructuralSimilarity, PixelsOutsideTheMask_DoNotCount) {
  const Image image = waves(0);
  Image other = image;
  ByteImage mask(24, 20, 1, 1);
  for (int y = 0; y < 20; ++y) {
    for (int x = 12; x < 24; ++x) {
      mask.at(x, y) = 0;
      other.at(x, y, 1) = 0.9F;
    }
  }
  EXPECT_NEAR(structural_similarity(image, other, mask), 1, 1e-12);
  EXPECT_EQ(structural_similarity(image, other, ByteImage(24, 20, 1)), 1);
}

TEST(StructuralSimilarityRefused, OtherSizes_Throw) {
  ATELIER_EXPECT_REFUSED(structural_similarity(waves(0), Image(20, 24, 3), ByteImage(24, 20, 1)),
                         LogicError, "differ in size");
}

}  // namespace
}  // namespace atelier
