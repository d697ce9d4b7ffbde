#include "core/render/studio.h"

#include <gtest/gtest.h>

#include "tests/core_render/shapes.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

TEST(Studio, SphereIsWellExposed) {
  const Image picture = picture_of(testing::sphere(), kThreeQuarter, {400, 400, 8, {}});
  testing::keep_picture("studio_sphere", picture);
  for (const float value : picture.data) {
    ASSERT_GE(value, 0.0f);
    ASSERT_LE(value, 1.0f);
  }
}

}  // namespace
}  // namespace atelier
