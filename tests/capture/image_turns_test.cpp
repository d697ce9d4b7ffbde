// Quarter turns of images and of pixels, against each other and against what EXIF's numbers mean.

#include "capture/image_turns.h"

#include <gtest/gtest.h>

namespace atelier {
namespace {

ByteImage numbered(int width, int height) {
  ByteImage image(width, height, 2);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y, 0) = static_cast<std::uint8_t>(x);
      image.at(x, y, 1) = static_cast<std::uint8_t>(y);
    }
  }
  return image;
}

TEST(ImageTurns, PixelsOfTurnedImages_AreWhereTheyWere) {
  const ByteImage image = numbered(5, 3);
  for (int quarters = -4; quarters < 8; ++quarters) {
    const ByteImage turned = turned_image(image, quarters);
    ASSERT_EQ(turned.width, quarters % 2 == 0 ? 5 : 3);
    ASSERT_EQ(turned.height, quarters % 2 == 0 ? 3 : 5);
    const int once = ((quarters % 4) + 4) % 4;
    for (int y = 0; y < turned.height; ++y) {
      for (int x = 0; x < turned.width; ++x) {
        const Eigen::Vector2d was = turned_back({x + 0.5, y + 0.5}, once, 5, 3);
        EXPECT_EQ(turned.at(x, y, 0), was.x() - 0.5) << quarters;
        EXPECT_EQ(turned.at(x, y, 1), was.y() - 0.5) << quarters;
      }
    }
    EXPECT_EQ(turned_image(turned, -quarters).data, image.data) << quarters;
  }
  // Clockwise: what was first in the first row is last in it.
  EXPECT_EQ(turned_image(image, 1).at(2, 0, 0), 0);
  EXPECT_EQ(turned_image(image, 1).at(2, 0, 1), 0);
}

// EXIF 2.3, 4.6.4: where row 0 and column 0 of the stored image are when it is shown.
TEST(ImageTurns, Orientations_AreThoseOfExif) {
  struct Row {
    int orientation;
    int shown;
    int upright;
  };
  for (const Row& row : {Row{1, 0, 0}, Row{2, -1, 0}, Row{3, 2, 2}, Row{4, -1, 2}, Row{5, -1, 1},
                         Row{6, 1, 1}, Row{7, -1, 3}, Row{8, 3, 3}}) {
    EXPECT_EQ(quarters_shown(row.orientation), row.shown) << row.orientation;
    EXPECT_EQ(quarters_upright(row.orientation), row.upright) << row.orientation;
  }
  // 6: row 0 is the right side, column 0 the top.
  const ByteImage shown = turned_image(numbered(5, 3), quarters_shown(6));
  for (int k = 0; k < shown.height; ++k) {
    EXPECT_EQ(shown.at(shown.width - 1, k, 1), 0);
  }
  for (int k = 0; k < shown.width; ++k) {
    EXPECT_EQ(shown.at(k, 0, 0), 0);
  }
}

}  // namespace
}  // namespace atelier
