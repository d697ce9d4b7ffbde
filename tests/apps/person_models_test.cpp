// The stages personalize, track and body by command with another body model than the default one.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/personal_body.h"
#include "core/sequence_archive.h"
#include "core/store/manifest.h"
#include "tests/apps/person_fixture.h"
#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

// Somebody of MakeHuman's shape space in a dress, measured and followed with MakeHuman's body. True
// surfaces: those of cameras as small as these would say little of a body.
TEST(PersonOfMakeHuman, MakeHumanPersonInADress_IsTrackedAndMeasured) {
  ATELIER_TEST_FILE(model, "makehuman/base/base.obj");
  const TemporaryDirectory own;
  const std::string capture = (own.path() / "capture").string();
  const std::string workspace = (own.path() / "work").string();
  const auto run = [&](std::vector<std::string> command) {
    command.insert(command.begin(), program_path());
    return run_child(command);
  };
  const ChildResult made =
      run(person_capture(capture, {"--body", model.string(), "--fabric.resolution", "128",
                                   "--skin_resolution", "128", "--samples", "1", "--minimal_frames",
                                   "2", "--dome.width", "90", "--dome.height", "120"}));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<std::vector<std::string>> steps = {
      person_scans(capture, workspace),
      {"personalize", capture, workspace, "--body", model.string(), "--input.scans", "ground_truth",
       "--samples", "800", "--shape-rounds", "3", "--surface-rounds", "2"},
      {"track", capture, workspace, "--input.scans", "ground_truth", "--samples", "800",
       "--compare", "false"},
      {"body", capture, workspace, "--ground-truth-scans", "true", "--iterations", "2",
       "--gap-frames", "1"}};
  for (const std::vector<std::string>& step : steps) {
    const ChildResult result = run(step);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("untrusted"))) << step.front();
  }
  const PersonalBody person =
      read_personal_body(fs::path(workspace) / "personalize" / "current" / "person.npz");
  const fs::path body = fs::canonical(fs::path(workspace) / "body" / "current");
  const Sequence bodies = open_sequence(body);
  EXPECT_EQ(bodies.faces.rows(), person.model.mesh.faces.rows());
  EXPECT_GT(person.model.mesh.faces.rows(), 20000) << "MakeHuman's, not the default human's";
  EXPECT_EQ(read_manifest(body, "body").metrics.at("untrusted"), 0);
  const ChildResult judged = run({"evaluate", workspace, "--ground-truth", capture, "--json"});
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const nlohmann::json figures = nlohmann::json::parse(judged.out);
  std::printf("tracked %.1f mm, body %.1f mm, covered %.1f mm, outside %.4f\n",
              figures.at("track.mean_mm").get<double>(), figures.at("body.mean_mm").get<double>(),
              figures.at("body.covered_mean_mm").get<double>(),
              figures.at("body.outside_rate").get<double>());
  EXPECT_LT(figures.at("track.mean_mm"), 12);
  EXPECT_LT(figures.at("body.mean_mm"), 8);
  EXPECT_LT(figures.at("body.covered_mean_mm"), 12);
  EXPECT_LT(figures.at("body.outside_rate"), 0.02);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
