// Plots of a simulation in the report.
#include "pipeline/cloth/simulate_pictures.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

/// The plots of a result of `solver` with this table of frames.
std::string plots_of(const std::string& solver, const std::string& table) {
  const fixtures::TemporaryDirectory root;
  StageStatus own;
  own.stage = "simulate";
  own.state = StageStatus::State::Done;
  own.manifest.emplace();
  own.manifest->stage = "simulate";
  own.manifest->options = {{"fps", "60", "default"}, {"solver", "\"" + solver + "\"", "flag"}};
  const fs::path result = root.path() / "simulate" / folder_name(own.manifest->key);
  fs::create_directories(result);
  std::ofstream(result / "frames.csv") << table;
  return simulate_pictures(own, {root.path(), {}});
}

TEST(SimulatePictures, ResidualThatWasNotMeasured_IsLeftOutAndSaid) {
  const std::string xpbd =
      "frame,seconds,strain_p95,spring_residual_m,strain_residual\n"
      "1,0.0166666667,0.01,2e-05,\n2,0.0333333333,0.02,1e-05,\n";
  const std::string of_xpbd = plots_of("xpbd", xpbd);
  EXPECT_THAT(of_xpbd, HasSubstr("residual of springs"));
  EXPECT_THAT(of_xpbd, Not(HasSubstr("residual of strain"))) << "no strain triangles";
  EXPECT_THAT(of_xpbd, Not(HasSubstr("measures none")));
  const std::string zeros =  // as builds wrote that did not tell what was not measured
      "frame,seconds,strain_p95,spring_residual_m,strain_residual\n"
      "1,0.0166666667,0.01,0,0\n2,0.0333333333,0.02,0,0\n";
  const std::string empty =
      "frame,seconds,strain_p95,spring_residual_m,strain_residual\n"
      "1,0.0166666667,0.01,,\n2,0.0333333333,0.02,,\n";
  for (const std::string& table : {zeros, empty}) {
    const std::string other = plots_of("projective-friction", table);
    EXPECT_THAT(other, HasSubstr("edge strain, p95"));
    EXPECT_THAT(other, Not(HasSubstr("residual of")));
    EXPECT_THAT(other, HasSubstr("residuals are of constraints of xpbd, projective-friction "
                                 "measures none"));
  }
}

}  // namespace
}  // namespace atelier
