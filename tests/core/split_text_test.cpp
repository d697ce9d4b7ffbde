#include "core/split_text.h"

#include <gmock/gmock.h>

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(SplitText, Separators_AreLeftOut) {
  EXPECT_THAT(split_text("a,b,,c", ','), ElementsAre("a", "b", "", "c"));
}

TEST(SplitText, LastLineEnd_BeginsNoFurtherLine) {
  EXPECT_THAT(split_text("one\ntwo\n", '\n'), ElementsAre("one", "two"));
  EXPECT_THAT(split_text("one\ntwo", '\n'), ElementsAre("one", "two"));
}

TEST(SplitText, EmptyText_HasNoPart) {
  EXPECT_THAT(split_text("", '\n'), IsEmpty());
  EXPECT_THAT(split_text("\n", '\n'), ElementsAre(""));
}

}  // namespace
}  // namespace atelier
