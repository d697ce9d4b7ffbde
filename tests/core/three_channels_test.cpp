#include "core/three_channels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::ElementsAre;

TEST(InThreeChannels, GreyImage_HasItsValueInEach) {
  ByteImage grey(2, 1, 1);
  grey.data = {7, 9};
  const ByteImage colour = in_three_channels(grey);
  EXPECT_EQ(colour.channels, 3);
  EXPECT_THAT(colour.data, ElementsAre(7, 7, 7, 9, 9, 9));
  Image light(1, 1, 1);
  light.data = {0.5F};
  EXPECT_THAT(in_three_channels(light).data, ElementsAre(0.5F, 0.5F, 0.5F));
}

TEST(InThreeChannels, OtherImages_AreAsTheyWere) {
  ByteImage colour(1, 1, 3);
  colour.data = {1, 2, 3};
  EXPECT_THAT(in_three_channels(colour).data, ElementsAre(1, 2, 3));
  EXPECT_TRUE(in_three_channels(ByteImage()).data.empty());
}

}  // namespace
}  // namespace atelier
