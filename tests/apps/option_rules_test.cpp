#include "pipeline/stages/option_rules.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/options.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"

namespace atelier {
namespace {

using fixtures::ChildResult;
using fixtures::program_path;
using fixtures::run_child;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

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

TEST(OptionRules, Defaults_BreakNoRule) {
  Some some;
  EXPECT_THAT(broken_rules(some.table()), IsEmpty());
}

TEST(OptionRules, OptionOfAnotherSolver_IsNamed) {
  std::string solver = "projective-friction";
  int own = 5;
  int other = 10;
  OptionTable table;
  table.add("cloth.solver", solver, {"xpbd", "projective-friction"}, "Solver");
  table.add("cloth.xpbd.substeps", other, 1, 100, "", "Substeps");
  table.add("cloth.projective_friction.substeps", own, 1, 100, "", "Substeps");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  EXPECT_EQ(set_option(table, "cloth.projective_friction.substeps", "7"), "");
  EXPECT_THAT(broken_rules(table), IsEmpty());
  EXPECT_EQ(set_option(table, "cloth.xpbd.substeps", "7"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre("cloth.xpbd.substeps does nothing with cloth.solver "
                          "projective-friction: leave it out, take "
                          "--cloth.projective-friction.substeps, or say --cloth.solver xpbd"));
}

TEST(OptionRules, OptionThatTheChosenSolverLacks_IsNamedAlone) {
  std::string solver = "xpbd";
  double limit = 0;
  OptionTable table;
  table.add("solver", solver, {"xpbd", "projective-friction"}, "Solver");
  table.add("projective_friction.strain_limit", limit, 0, 1, "", "Limit");
  EXPECT_EQ(set_option(table, "projective_friction.strain_limit", "0.1"), "");
  EXPECT_THAT(broken_rules(table),
              ElementsAre("projective_friction.strain_limit does nothing with solver xpbd: leave "
                          "it out, or say --solver projective-friction"));
}

TEST(OptionRules, OptionWithoutEffect_IsNamedWithItsCause) {
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

TEST(OptionRules, RequiredOption_IsReported) {
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
  EXPECT_THAT(broken_rules(table),
              ElementsAre(HasSubstr("track.exclude region takes --track.region")));
}

TEST(OptionRulesRefused, SwingOptionsWithoutSearch_AreRefused) {
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

#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)
/// What a stage says of options before it looks at its input, which is not there.
ChildResult said_of(const std::string& stage, const std::vector<std::string>& options) {
  std::vector<std::string> command = {program_path(), stage, "no_capture", "no_workspace"};
  command.insert(command.end(), options.begin(), options.end());
  return run_child(command);
}

struct IdleOption {
  const char* stage;
  const char* option;
  const char* text;
  const char* other;
  const char* other_text;
};

TEST(OptionRulesRefused, PersonOptionsUnusedBesideOthers_AreRefused) {
  constexpr std::array kIdle = {
      IdleOption{"body", "coupling-length", "0.1", "coupling", "false"},
      IdleOption{"body", "temporal-weight", "0.5", "temporal", "false"},
      IdleOption{"body", "around", "4", "temporal", "false"},
      IdleOption{"body", "outside-weight", "5", "sign", "unsigned"},
      IdleOption{"body", "gap-frames", "5", "gap", "0.003"},
      IdleOption{"body", "tight-scale", "0.01", "tight-weight", "0"},
      IdleOption{"body", "skin-reach", "0.01", "skin-weight", "0"},
      IdleOption{"refine", "coupling-length", "0.1", "coupling", "false"},
      IdleOption{"track", "model-to-scan", "1", "rounds", "0"},
      IdleOption{"track", "dynamic.swing", "0.1", "rounds", "0"},
      IdleOption{"personalize", "smoothness", "0.05", "surface-rounds", "0"},
      IdleOption{"personalize", "displacement", "0.05", "surface-rounds", "0"},
  };
  for (const IdleOption& idle : kIdle) {
    const std::string option = std::string("--") + idle.option;
    const std::string other = std::string("--") + idle.other;
    const ChildResult both = said_of(idle.stage, {option, idle.text, other, idle.other_text});
    EXPECT_EQ(both.exit_code, 2) << idle.stage << " " << option;
    EXPECT_THAT(both.err, HasSubstr(" does nothing with ")) << idle.stage << " " << option;
    EXPECT_THAT(said_of(idle.stage, {option, idle.text}).err, Not(HasSubstr("does nothing")));
    EXPECT_THAT(said_of(idle.stage, {other, idle.other_text}).err, Not(HasSubstr("does nothing")));
  }
}

TEST(OptionRulesRefused, TrialOptionsOfTheOtherSolver_AreRefused) {
  const ChildResult other =
      said_of("material", {"--solver", "projective-friction", "--xpbd.iterations", "2"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err,
              HasSubstr("--xpbd.iterations does nothing with --solver projective-friction: leave "
                        "it out, take --projective-friction.iterations, or say --solver xpbd"));
  const ChildResult fabric =
      said_of("material", {"--material.name", "denim", "--solver", "projective-friction",
                           "--projective-friction.acceleration", "0"});
  EXPECT_EQ(fabric.exit_code, 2);
  EXPECT_THAT(fabric.err, HasSubstr("--projective-friction.acceleration does nothing with "
                                    "--material.name denim"));
  const ChildResult bare =
      said_of("material", {"--solver", "projective-friction", "--substeps", "5"});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_THAT(bare.err, HasSubstr("did you mean '--projective-friction.substeps'?"));
}

// `evaluate` judges every exclusion by labels, and what is left out without scans is said.
TEST(OptionRules, PersonOptionsUsedBesideOthers_AreAccepted) {
  EXPECT_THAT(said_of("track", {"--input.excluded", "lower"}).err, Not(HasSubstr("does nothing")));
  EXPECT_THAT(said_of("track", {"--exclude", "labels", "--input.scans", "none", "--rounds", "0",
                                "--compare", "false"})
                  .err,
              Not(HasSubstr("does nothing")));
  EXPECT_THAT(said_of("track", {"--input.scans", "none", "--samples", "100"}).err,
              Not(HasSubstr("does nothing")))
      << "the rest stays as it is: a comparison";
  EXPECT_EQ(said_of("refine", {"--temporal", "false"}).exit_code, 2);
}
#endif

#ifdef ATELIER_HAS_CAPTURE
TEST(OptionRulesRefused, UnwornLabels_AreRefused) {
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
              ElementsAre(HasSubstr("track.exclude labels takes --track.input.excluded")));
}
#endif

TEST(OptionRulesRefused, CameraCorrectionsWithoutCameras_AreRefused) {
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

TEST(OptionRulesRefused, UnitAndUpWithoutCameras_AreRefused) {
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

TEST(OptionRules, SectionOptions_FollowTheirSwitch) {
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
