#include "core/renamed_options.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/options.h"

namespace atelier {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

enum class Networks { Learnt, Oracle };

struct RenamedHull {
  double voxel_size = 0.02;
  int min_views = 2;
  Networks networks = Networks::Learnt;
};

OptionTable describe(RenamedHull& options) {
  OptionTable table;
  table.add("hull.voxel_size", options.voxel_size, 0.001, 1, "m", "Edge length of a voxel");
  table.add("min_views", options.min_views, 2, 100, "", "Minimum number of views");
  table.add("networks", options.networks,
            {{"learnt", Networks::Learnt}, {"oracle", Networks::Oracle}}, "Stage of the networks");
  return table;
}

struct RenamedOptionsTest : testing::Test {
  RenamedHull options;
  OptionTable table = describe(options);
};

TEST_F(RenamedOptionsTest, FormerNameOfFlag_SetsOptionWithNotice) {
  EXPECT_EQ(set_option(table, "least_views", "5"), "");
  EXPECT_EQ(options.min_views, 5);
  EXPECT_EQ(table.fields[1].source, "flag");
  EXPECT_THAT(table.notices, ElementsAre("least_views is now min_views"));
}

TEST_F(RenamedOptionsTest, FormerNameInFile_NoticeNamesLine) {
  EXPECT_EQ(set_option(table, "hull.cell", "0.5", "outfit.toml:3"), "");
  EXPECT_EQ(options.voxel_size, 0.5);
  EXPECT_EQ(table.fields[0].source, "outfit.toml:3");
  EXPECT_THAT(table.notices, ElementsAre("outfit.toml:3: hull.cell is now hull.voxel_size"));
}

TEST_F(RenamedOptionsTest, FormerChoice_SetsOptionWithNotice) {
  EXPECT_EQ(set_option(table, "networks", "ceiling"), "");
  EXPECT_EQ(options.networks, Networks::Oracle);
  EXPECT_THAT(table.notices, ElementsAre("the value 'ceiling' of networks is now 'oracle'"));
}

TEST_F(RenamedOptionsTest, PresentName_GivesNoNotice) {
  EXPECT_EQ(set_option(table, "min_views", "3"), "");
  EXPECT_EQ(set_option(table, "networks", "oracle"), "");
  EXPECT_THAT(table.notices, IsEmpty());
}

TEST_F(RenamedOptionsTest, FormerNameWithValueOutOfRange_Refused) {
  EXPECT_THAT(set_option(table, "least_views", "1"), HasSubstr("min_views cannot be '1'"));
  EXPECT_EQ(options.min_views, 2);
}

TEST_F(RenamedOptionsTest, FormerNameOfNoOptionHere_Refused) {
  EXPECT_THAT(set_option(table, "leash", "20"), HasSubstr("there is no option 'leash'"));
  EXPECT_THAT(set_option(table, "cell", "0.5"), HasSubstr("there is no option 'cell'"));
  EXPECT_THAT(set_option(table, "my_least_views", "5"), HasSubstr("there is no option"));
}

TEST(RenamedOption, NestedName_KeepsItsSections) {
  const std::vector<std::string> known = {"reconstruct.hull.voxel_size", "oracle.fuse.min_views",
                                          "oracle.seed"};
  EXPECT_EQ(renamed_option("reconstruct.hull.cell", known), "reconstruct.hull.voxel_size");
  EXPECT_EQ(renamed_option("ceiling.fuse.least_views", known), "oracle.fuse.min_views");
  EXPECT_EQ(renamed_option("ceiling.seed", known), "oracle.seed");
  EXPECT_EQ(renamed_option("hull.cell", known), "");
  EXPECT_EQ(renamed_option("", known), "");
}

TEST(RenamedStage, FormerName_GivesPresentOne) {
  EXPECT_EQ(renamed_stage("ceiling"), "oracle");
  EXPECT_EQ(renamed_stage("draw"), "render-neural");
  EXPECT_EQ(renamed_stage("register"), "");
  EXPECT_EQ(renamed_stage(""), "");
  EXPECT_EQ(former_stage("oracle"), "ceiling");
  EXPECT_EQ(former_stage("register"), "");
}

TEST(PresentMetric, FormerName_GivesPresentOne) {
  EXPECT_EQ(present_metric("gave_way_most"), "deviation_max");
  EXPECT_EQ(present_metric("truth_scans"), "ground_truth_scans");
  EXPECT_EQ(present_metric("frames"), "frames");
}

}  // namespace
}  // namespace atelier
