#include "apps/option_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/body_stage.h"
#include "apps/personalize_stage.h"
#include "apps/track_stage.h"
#include "core/options.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Some options of a simulation, in a section or at the root.
struct Some {
  std::string membrane = "springs";
  std::string shear = "none";
  double material_shear = 100;
  bool relax = false;
  int rounds = 12;
  std::string sweep = "gauss-seidel";
  double jacobi_radius = 0.9;

  OptionTable table() {
    OptionTable out;
    out.add("membrane", membrane, {"springs", "strain"}, "Membrane");
    out.add("shear", shear, {"none", "cross"}, "Shear springs");
    out.add("material.shear", material_shear, 0, 1e9, "N/m", "Shear modulus");
    out.add("relax", relax, "Relax");
    out.add("relaxing.rounds", rounds, 1, 100, "", "Rounds");
    out.add("xpbd.sweep", sweep, {"gauss-seidel", "jacobi"}, "Sweep");
    out.add("xpbd.jacobi_radius", jacobi_radius, 0, 1, "", "Radius");
    return out;
  }
};

TEST(OptionRules, DefaultsAreNeverIdle) {
  Some some;
  EXPECT_THAT(broken_rules(some.table()), IsEmpty());
}

TEST(OptionRules, WhatIsSaidAndDoesNothingIsNamedWithWhatMakesItIdle) {
  Some some;
  OptionTable table = some.table();
  EXPECT_EQ(set_option(table, "material.shear", "5000"), "");
  EXPECT_EQ(set_option(table, "xpbd.jacobi_radius", "0.5"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(AllOf(HasSubstr("material.shear does nothing with membrane springs and "
                                          "shear none"),
                                HasSubstr("--membrane strain")),
                          AllOf(HasSubstr("xpbd.jacobi_radius does nothing with xpbd.sweep "
                                          "gauss-seidel"),
                                HasSubstr("--xpbd.sweep jacobi"))));
  EXPECT_EQ(set_option(table, "shear", "cross"), "");
  EXPECT_EQ(set_option(table, "xpbd.sweep", "jacobi"), "");
  EXPECT_THAT(broken_rules(table), IsEmpty());
}

TEST(OptionRules, WhatAnotherAsksForIsSaid) {
  std::string exclude = "auto";
  std::string region;
  OptionTable table;
  table.add("track.exclude", exclude, {"auto", "region"}, "Exclude");
  table.add("track.region", region, std::vector<std::string>{}, "Region");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  EXPECT_EQ(set_option(table, "track.region", "torso"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("track.region does nothing with track.exclude auto")));
  EXPECT_EQ(set_option(table, "track.exclude", "region"), "");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  region.clear();
  EXPECT_THAT(broken_rules(table), ElementsAre(HasSubstr("track.exclude region takes --region")));
}

TEST(OptionRulesRefused, WhatFindsClothingThatSwingsWhereNothingIsSought) {
  std::string exclude = "auto";
  double swing = 0.01;
  bool compare = true;
  OptionTable table;
  table.add("exclude", exclude, {"auto", "labels", "none"}, "Exclude");
  table.add("dynamic.swing", swing, 0, 1, "m", "Swing");
  table.add("compare", compare, "Compare");
  EXPECT_EQ(set_option(table, "dynamic.swing", "0.02"), "");
  EXPECT_EQ(set_option(table, "compare", "false"), "");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  EXPECT_EQ(set_option(table, "exclude", "labels"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("dynamic.swing does nothing with exclude labels")));
  EXPECT_EQ(set_option(table, "exclude", "none"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("dynamic.swing does nothing with exclude none"),
                          HasSubstr("compare does nothing with exclude none")));
}

#if defined(ATELIER_HAS_CAPTURE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)
/// The one problem of a stage's own table, which says with what an option does nothing.
template <typename Options>
void expect_idle(const std::string& option, const std::string& text, const std::string& other,
                 const std::string& other_text) {
  Options options;
  OptionTable table = describe(options);
  ASSERT_EQ(set_option(table, option, text), "");
  EXPECT_THAT(broken_rules(table), IsEmpty()) << option;
  ASSERT_EQ(set_option(table, other, other_text), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr(option + " does nothing with " + other + " " + other_text)));
}

TEST(OptionRulesRefused, WhatThePersonsStagesDoNotReadBesideOthers) {
  expect_idle<BodyStageOptions>("coupling_length", "0.1", "coupling", "false");
  expect_idle<BodyStageOptions>("temporal_weight", "0.5", "temporal", "false");
  expect_idle<BodyStageOptions>("outside_weight", "5", "sign", "unsigned");
  expect_idle<BodyStageOptions>("gap_frames", "5", "gap", "0.003");
  expect_idle<RefineStageOptions>("coupling_length", "0.1", "coupling", "false");
#ifdef ATELIER_HAS_CAPTURE_SURFACE
  for (const char* option : {"samples", "model_to_scan", "rounds"}) {
    expect_idle<TrackStageOptions>(option, "1", "input.scans", "none");
  }
  expect_idle<TrackStageOptions>("samples", "100", "rounds", "0");
  expect_idle<TrackStageOptions>("exclude", "none", "rounds", "0");
  expect_idle<TrackStageOptions>("compare", "false", "rounds", "0");
  expect_idle<PersonalizeStageOptions>("samples", "100", "input.scans", "none");
  for (const char* option : {"displacement", "smoothness", "surface_noise"}) {
    expect_idle<PersonalizeStageOptions>(option, "0.05", "surface_rounds", "0");
  }
  TrackStageOptions options;
  OptionTable table = describe(options);
  ASSERT_EQ(set_option(table, "input.excluded", "outer"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("input.excluded does nothing with exclude auto")));
  ASSERT_EQ(set_option(table, "exclude", "labels"), "");
  EXPECT_THAT(broken_rules(table), IsEmpty());
#endif
}
#endif

#ifdef ATELIER_HAS_CAPTURE
TEST(OptionRulesRefused, LabelsOfWhatIsNotWorn) {
  std::string exclude = "labels";
  std::string excluded = "dress";
  OptionTable table;
  table.add("track.exclude", exclude, {"auto", "labels"}, "Exclude");
  table.add("track.input.excluded", excluded, std::vector<std::string>{}, "Excluded");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  EXPECT_EQ(set_option(table, "track.input.excluded", "dress, hat"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("track.input.excluded cannot be 'hat'; it takes names of "
                                    "labels of what is worn")));
  excluded.clear();
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("track.exclude labels takes --input.excluded")));
}
#endif

TEST(OptionRulesRefused, CorrectionsOfCamerasWhereNoneAreRead) {
  std::string extrinsics;
  std::string sync;
  OptionTable table;
  for (const char* section : {"capture", "track.input.capture"}) {
    table.add(std::string(section) + ".calibration_of", sync, std::vector<std::string>{}, "Of");
    table.add(std::string(section) + ".extrinsics", extrinsics, std::vector<std::string>{}, "Are");
  }
  EXPECT_EQ(set_option(table, "capture.extrinsics", "all=inverse"), "");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  EXPECT_EQ(set_option(table, "track.input.capture.extrinsics", "all=inverse"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre(AllOf(HasSubstr("track.input.capture.extrinsics does nothing"),
                                HasSubstr("reconstruct"))));
}

TEST(OptionRulesRefused, UnitAndUpOfACaptureWhereNoCameraIsRead) {
  double metres = 0;
  std::string text = "auto";
  OptionTable table;
  table.add("input.capture.metres_per_unit", metres, 0, 1e6, "m", "Unit");
  for (const char* name : {"up", "label_taxonomy", "keypoint_schema", "leave_out"}) {
    table.add(std::string("input.capture.") + name, text, std::vector<std::string>{}, "Text");
  }
  for (const OptionField& field : std::vector<OptionField>(table.fields)) {
    EXPECT_EQ(set_option(table, field.name, "1"), "");
  }
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("metres_per_unit does nothing"), HasSubstr("up does nothing"),
                          HasSubstr("label_taxonomy does nothing")));
}

TEST(OptionRules, ASectionBelongsToItsSwitchUnlessThatIsSaidToBeOff) {
  Some some;
  OptionTable inner = some.table();
  EXPECT_EQ(set_option(inner, "relaxing.rounds", "3"), "");
  EXPECT_THAT(broken_rules(inner), ElementsAre(HasSubstr("relaxing.rounds does nothing with relax "
                                                         "false")));
  OptionTable outer;
  outer.add("cloth", inner);
  EXPECT_THAT(broken_rules(outer), ElementsAre(HasSubstr("cloth.relaxing.rounds does nothing with "
                                                         "cloth.relax false")));
  EXPECT_EQ(set_option(inner, "relax", "false"), "");
  EXPECT_THAT(broken_rules(inner), IsEmpty()) << "a comparison";
}

}  // namespace
}  // namespace atelier
