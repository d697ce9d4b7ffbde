#include "core/render/scaled_pictures.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/core_render/shapes.h"

namespace atelier {
namespace {

/// How many pixels differ clearly from an image of nothing to be seen at their place: the subject.
int covered(const Image& picture, const Image& other) {
  int count = 0;
  for (std::size_t i = 0; i < picture.data.size(); i += 3) {
    count += std::abs(picture.data[i] - other.data[i]) > 0.05F ? 1 : 0;
  }
  return count;
}

TEST(PicturesAtOneScale, LargerSubject_AppearsLarger) {
  Mesh small = fixtures::sphere();
  Mesh tiny = small;
  small.vertices *= 0.5;
  tiny.vertices *= 0.05;
  Mesh large = fixtures::sphere();
  large.vertices.rowwise() += Eigen::RowVector3d(7, 0, -3);  // where it stands is nothing
  const auto pictures = pictures_at_one_scale({large, small, tiny}, kThreeQuarter, {64, 64, 4, {}});
  ASSERT_EQ(pictures.size(), 3U);
  EXPECT_EQ(pictures[0].width, 64);
  EXPECT_EQ(pictures[0].height, 64);
  EXPECT_GT(covered(pictures[0], pictures[2]), covered(pictures[1], pictures[2]));
}

TEST(PicturesAtOneScale, NoSubject_ThrowsLogicError) {
  EXPECT_THROW(pictures_at_one_scale(std::vector<Mesh>{}), LogicError);
}

}  // namespace
}  // namespace atelier
