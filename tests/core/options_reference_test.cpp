#include "core/options_reference.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using testing::HasSubstr;
using testing::Not;

struct Yarn {
  double length = 1;
  int plies = 2;
};

OptionTable describe(Yarn& yarn) {
  OptionTable table;
  table.add("length", yarn.length, 0, 10, "m", "Length of the yarn");
  table.add("plies", yarn.plies, 1, 8, "", "Strands of the yarn");
  return table;
}

struct TwoOwners : testing::Test {
  Yarn first, second, third;
  bool loud = false;
  std::vector<OptionOwner> owners{{"spin", {}}, {"weave", {}}};

  void SetUp() override {
    owners[0].table.add("yarn", describe(first));
    owners[0].table.add("loud", loud, "Words on the way");
    owners[1].table.add("warp.yarn", describe(second));
  }
};

int times(const std::string& text, const std::string& what) {
  int count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++count;
  }
  return count;
}

TEST_F(TwoOwners, GroupOfTwoOwners_IsPrintedOnceAndReferredToUnderBothPrefixes) {
  const std::string text = options_reference(owners);
  EXPECT_EQ(times(text, "Length of the yarn"), 1);
  EXPECT_EQ(times(text, "Strands of the yarn"), 1);
  EXPECT_THAT(text, HasSubstr("### `yarn.*`\n\nOf `spin` and `weave`.\n\n| option |"));
  EXPECT_THAT(text, HasSubstr("## atelier spin\n\n- `yarn.*`: [`yarn.*`](#yarn)\n\n| option |"));
  EXPECT_THAT(text, HasSubstr("## atelier weave\n\n- `warp.yarn.*`: [`yarn.*`](#yarn)\n"));
  EXPECT_THAT(text, HasSubstr("| `loud` | `false` |"));
}

TEST_F(TwoOwners, DefaultThatDiffers_IsNamedInTheOwnersSection) {
  second.plies = 4;
  const std::string text = options_reference(owners);
  EXPECT_THAT(text, HasSubstr("| `yarn.plies` | `2` |"));
  EXPECT_THAT(text, HasSubstr("(#yarn); default here: `warp.yarn.plies` `4`\n"));
}

TEST_F(TwoOwners, DefaultOfMostOwners_StandsInTheCommonTable) {
  second.plies = third.plies = 4;
  owners.push_back({"knit", {}});
  owners[2].table.add("yarn", describe(third));
  const std::string text = options_reference(owners);
  EXPECT_THAT(text, HasSubstr("| `yarn.plies` | `4` |"));
  EXPECT_THAT(text, HasSubstr("default here: `yarn.plies` `2`\n"));
}

TEST_F(TwoOwners, OptionWithoutAPrefixInOnePlace_IsNamedThere) {
  owners[1].table = describe(second);
  EXPECT_THAT(options_reference(owners),
              HasSubstr("## atelier weave\n\n- `length` and `plies`: [`yarn.*`](#yarn)\n"));
}

TEST_F(TwoOwners, OptionOfAnotherHelpOrRange_IsNotCommon) {
  owners[1].table.fields[0].help = "Another";
  owners[1].table.fields[1].max = 9;
  const std::string text = options_reference(owners);
  EXPECT_THAT(text, Not(HasSubstr("Common options")));
  EXPECT_THAT(text, HasSubstr("| `warp.yarn.length` |"));
}

TEST_F(TwoOwners, SingleRowThatTwoOwnersShare_StaysInTheirTables) {
  owners[1].table.fields[0].help = "Another";
  const std::string text = options_reference(owners);
  EXPECT_THAT(text, Not(HasSubstr("Common options")));
  EXPECT_EQ(times(text, "Strands of the yarn"), 2);
}

TEST_F(TwoOwners, TwoGroupsOfOneName_HaveHeadingsOfTheirOwn) {
  bool dry = false;
  bool soft = false;
  for (const char* name : {"felt", "knit"}) {
    owners.push_back({name, {}});
    owners.back().table.add("yarn.dry", dry, "Without water");
    owners.back().table.add("yarn.soft", soft, "With soap");
  }
  const std::string text = options_reference(owners);
  EXPECT_THAT(text, HasSubstr("### `yarn.*` (2)\n\nOf `felt` and `knit`."));
  EXPECT_THAT(text, HasSubstr("## atelier felt\n\n- `yarn.*`: [`yarn.*` (2)](#yarn-2)\n"));
}

TEST(OptionsReference, NoOwners_GivesNothing) {
  EXPECT_EQ(options_reference({}), "");
}

}  // namespace
}  // namespace atelier
