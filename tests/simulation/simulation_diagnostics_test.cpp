#include "simulation/simulation_diagnostics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<FrameReport> frames(int count) {
  std::vector<FrameReport> reports(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    FrameReport& report = reports[static_cast<std::size_t>(i)];
    report.frame = i + 1;
    report.strain_p95 = 0.05;
    report.inside = report.body_crossings = report.crossings = 0;
    report.inside_depth = 0.0004;
  }
  return reports;
}

TEST(SimulationDiagnostics, GoodCloth_HasNoWarning) {
  EXPECT_THAT(simulation_diagnostics({}, false), IsEmpty());
  EXPECT_THAT(simulation_diagnostics(frames(3), false), IsEmpty());
}

TEST(SimulationDiagnostics, Warnings_NameTheWorstFrameAndARemedy) {
  std::vector<FrameReport> reports = frames(4);
  reports[1].strain_p95 = 0.3;
  reports[2].strain_p95 = 2.05;
  reports[0].body_crossings = 606;
  reports[3].inside = 3;
  reports[3].inside_depth = 0.0033;
  EXPECT_THAT(simulation_diagnostics(reports, false),
              ElementsAre(AllOf(HasSubstr("205%"), HasSubstr("frame 3"), HasSubstr("substeps")),
                          AllOf(HasSubstr("3 vertices"), HasSubstr("3.3 mm"), HasSubstr("frame 4")),
                          AllOf(HasSubstr("606"), HasSubstr("frame 1"), HasSubstr("thickness"))));
}

TEST(SimulationDiagnostics, SingleOverstretchedEdge_IsWarnedOf) {
  std::vector<FrameReport> reports = frames(3);
  reports[0].strain_max = 0.9;
  EXPECT_THAT(simulation_diagnostics(reports, false), IsEmpty());
  reports[1].strain_max = 3.5;
  EXPECT_THAT(simulation_diagnostics(reports, false),
              ElementsAre(AllOf(HasSubstr("350%"), HasSubstr("frame 2"))));
}

TEST(SimulationDiagnostics, DisabledSelfContact_IsNamedAsRemedy) {
  std::vector<FrameReport> reports = frames(2);
  reports[1].crossings = 167;
  EXPECT_THAT(simulation_diagnostics(reports, false),
              ElementsAre(HasSubstr("--self-contact true")));
  EXPECT_THAT(simulation_diagnostics(reports, true),
              ElementsAre(AllOf(HasSubstr("167"), Not(HasSubstr("self_contact")))));
}

TEST(SimulationDiagnostics, Remedies_AreOptionsOfTheSolver) {
  std::vector<FrameReport> reports = frames(2);
  reports[1].strain_p95 = 0.3;
  reports[1].body_crossings = 7;
  EXPECT_THAT(simulation_diagnostics(reports, true, {.section = "cloth"}),
              ElementsAre(HasSubstr("more --cloth.xpbd.substeps"),
                          HasSubstr("or --cloth.xpbd.body-edges true")));
  SolverOptions other;
  other.name = "projective-friction";
  EXPECT_THAT(
      simulation_diagnostics(reports, true, {.solver = other}),
      ElementsAre(HasSubstr("more --projective-friction.substeps"), Not(HasSubstr("body-edges"))));
}

TEST(SimulationDiagnostics, UncountedQuantities_AreNoWarning) {
  std::vector<FrameReport> reports = frames(2);
  for (FrameReport& report : reports) {
    report.inside = report.body_crossings = report.crossings = -1;
    report.inside_depth = -1;
  }
  EXPECT_THAT(simulation_diagnostics(reports, false), IsEmpty());
}

}  // namespace
}  // namespace atelier
