#include "core/store/flag_command.h"

#include <gtest/gtest.h>

namespace atelier::fixtures {
namespace {

struct Some {
  double thickness = 1;
  double wide = 1;
  bool body_edges = false;
  double fps = 1;
};

OptionTable describe(Some& some) {
  OptionTable table;
  table.add("solver.thickness", some.thickness, 0, 1, "m", "Thickness");
  table.add("left.wide", some.wide, 0, 1, "m", "Width");
  table.add("right.wide", some.wide, 0, 1, "m", "Width");
  table.add("body_edges", some.body_edges, "Edges");
  table.add("capture.fps", some.fps, 0, 1, "", "Frames a second");
  return table;
}

std::string told(const std::string& message) {
  Some some;
  return with_command(message, "simulate", describe(some));
}

TEST(FlagCommand, OptionsOfTheStage_AreSaidWithTheirCommand) {
  EXPECT_EQ(told("more --solver.thickness, or --body-edges true."),
            "more --solver.thickness, or --body-edges true. (atelier simulate; in atelier run "
            "--simulate.solver.thickness, --simulate.body-edges)");
}

TEST(FlagCommand, LastPartOfAName_IsCompletedWhereItIsClear) {
  EXPECT_EQ(told("more --thickness."),
            "more --solver.thickness. (atelier simulate; in atelier run "
            "--simulate.solver.thickness)");
  EXPECT_EQ(told("more --wide"), "more --wide");
}

TEST(FlagCommand, OtherFlags_StayAsTheyAre) {
  for (const char* message :
       {"", "--", "a -- b", "--capture.fps 24", "run 'atelier drape --body-edges true' first",
        "--jobs 2", "no flag"}) {
    EXPECT_EQ(told(message), message);
  }
}

TEST(FlagCommand, CommandOfAnotherSentence_DoesNotCount) {
  EXPECT_EQ(told("run 'atelier body'; --body-edges"),
            "run 'atelier body'; --body-edges (atelier simulate; in atelier run "
            "--simulate.body-edges)");
}

}  // namespace
}  // namespace atelier::fixtures
