// The scripts that make tables of comparisons: each runs to its end with a program that does no
// work, but has the real one read every command line, so that no variant names an option that is
// gone.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING)

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/child_process.h"
#include "tests/support/places.h"
#include "tests/support/read_text.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class TableScripts : public ::testing::Test {
 protected:
  void SetUp() override {
    const fs::path program = folder_ / "atelier";
    // A usage error alone ends it: that there is no capture is no matter.
    std::ofstream(program) << "#!/usr/bin/env bash\n"
                              "echo \"$*\" >>'"
                           << (folder_ / "commands").string()
                           << "'\n"
                              "case $1 in\n"
                              "  evaluate) cat '"
                           << (folder_ / "figures.json").string()
                           << "' ;;\n"
                              "  synthesize) '"
                           << program_path()
                           << "' \"$@\" --dry-run >&2 && mkdir -p \"$2\" ;;\n"
                              "  *) code=0; '"
                           << program_path()
                           << "' \"$@\" --dry-run >&2 || code=$?\n"
                              "     [[ $code != 2 ]] ;;\n"
                              "esac\n";
    fs::permissions(program, fs::perms::owner_all);
    setenv("ATELIER_PROGRAM", program.c_str(), 1);
  }
  void TearDown() override { unsetenv("ATELIER_PROGRAM"); }

  ChildResult run(const std::string& script, const std::vector<std::string>& arguments,
                  const std::string& figures) {
    std::ofstream(folder_ / "figures.json") << figures;
    std::vector<std::string> command = {(source_directory() / "scripts" / script).string()};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return run_child(command);
  }
  std::string commands() const { return read_text(folder_ / "commands"); }

  TemporaryDirectory folder_;
};

std::ptrdiff_t rows_with(const std::string& text, const std::string& cell) {
  std::ptrdiff_t rows = 0;
  for (std::size_t at = text.find(cell); at != std::string::npos; at = text.find(cell, at + 1)) {
    ++rows;
  }
  return rows;
}

TEST_F(TableScripts, BodyTable_HasARowPerVariant) {
  const ChildResult done =
      run("body-table", {(folder_ / "table").string(), "tee", "7", "tiny"},
          R"({"personal.mean_mm": 2.5, "track.mean_mm": 4, "body.mean_mm": 3})");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(commands(), HasSubstr("synthesize capture --preset tiny --garment tee --seed 7\n"
                                    "reconstruct capture work\n"));
  for (const char* surfaces : {"reconstructed", "ground_truth"}) {
    EXPECT_THAT(done.out, HasSubstr(std::string("| ") + surfaces + " surfaces: tracking |"));
  }
  EXPECT_EQ(rows_with(done.out, "| 2.50 |"), 4) << "persons measured on two sequences";
  EXPECT_EQ(rows_with(done.out, "| 4.00 |"), 4 + 10);
  EXPECT_EQ(rows_with(done.out, "| 3.00 |"), 12);
  EXPECT_EQ(rows_with(done.out, "| default | 3.00 | - |"), 2) << "what is not there is no figure";
}

TEST_F(TableScripts, RegistrationAndAppearanceTables_HaveARowPerVariant) {
  const ChildResult cloth =
      run("register-table", {"capture", (folder_ / "work").string()},
          R"({"register.chamfer_mm": 1.25, "register.point_mean_mm": 2, "register.point_p95_mm": 3,
          "register.inverted": 0, "register.drift_mm": 1})");
  ASSERT_EQ(cloth.exit_code, 0) << cloth.err;
  EXPECT_EQ(rows_with(cloth.out, "| 1.25 |"), 12);
  const ChildResult look =
      run("appearance-table", {"capture", (folder_ / "work").string(), "oracle", "--body", "true"},
          R"({"oracle.psnr_db": 26.5, "oracle.gain_db": 3, "oracle.shadow_psnr_db": 25,
          "oracle.ssim": 0.9})");
  ASSERT_EQ(look.exit_code, 0) << look.err;
  EXPECT_EQ(rows_with(look.out, "| 26.50 |"), 6);
  EXPECT_THAT(commands(), HasSubstr("--shadow false --body true\n"));
  const ChildResult body =
      run("appearance-table", {"capture", (folder_ / "work").string(), "avatar"},
          R"({"avatar.psnr_db": 27.5, "avatar.gain_db": 3, "avatar.head_hands_psnr_db": 28,
          "avatar.ssim": 0.9, "avatar.mean_mm": 4})");
  ASSERT_EQ(body.exit_code, 0) << body.err;
  EXPECT_EQ(rows_with(body.out, "| 27.50 | 3.00 | 28.00 | 0.900 | 4.00 |"), 8);
  EXPECT_THAT(commands(), HasSubstr("--code.latent 0\n"));
}

TEST_F(TableScripts, RegisterTable_ComparesWithTheCodedPrint) {
  const fs::path capture = folder_ / "capture";
  fs::create_directories(capture);
  std::ofstream(capture / "synthesis.json")
      << R"({"synthesis":6,"options":{"body_sequence":"","dome.cameras":6,"fabric.kind":"print",
         "garment":"tee","label.perfect":false,"seed":7}})";
  const fs::path coded = folder_ / "coded";
  const ChildResult done =
      run("register-table", {capture.string(), (folder_ / "work").string(), coded.string()},
          R"({"register.chamfer_mm": 1.25, "register.point_mean_mm": 2, "register.point_p95_mm": 3,
          "register.inverted": 0, "register.drift_mm": 1})");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(rows_with(done.out, "| 1.25 |"), 16);
  EXPECT_EQ(rows_with(done.out, "| coded print | scans |"), 1);
  EXPECT_EQ(rows_with(done.out, "| coded print | ground truth |"), 1);
  EXPECT_THAT(
      commands(),
      HasSubstr(
          "--dome.cameras 6 --fabric.kind coded --garment tee --label.perfect false --seed 7\n"));
  EXPECT_THAT(commands(), HasSubstr("template " + (coded / "capture").string() + " " +
                                    (coded / "workspace").string() + "\n"));
}

TEST_F(TableScripts, GarmentsTable_HasARowPerOutfitAndAblation) {
  std::ofstream(folder_ / "figures.json")
      << R"({"register.point_mean_mm": 4.5, "register.point_p95_mm": 20, "simulate.held_mm": 12})";
  const ChildResult done = run_child({"env", "ATELIER_TEST_DATA=" + folder_.path().string(),
                                      (source_directory() / "scripts/garments-table").string(),
                                      (folder_ / "table").string(), "--ablations", "tee_skirt"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(rows_with(done.out, "| tee_skirt | - | - | 4.5 | 20.0 |"), 1);
  for (const char* variant : {"one frame", "no simulated prediction", "nothing held", "default"}) {
    EXPECT_THAT(done.out, HasSubstr(std::string("| tee_skirt, ") + variant +
                                    " | - | - | 4.5 | 20.0 | 12 | - |\n"));
  }
  EXPECT_THAT(commands(), HasSubstr(" --template.source frame\n"));
  EXPECT_THAT(commands(), HasSubstr(" --simulate.holding none\n"));
}

TEST_F(TableScripts, ResultsTable_HasARowPerWayAndTheCommit) {
  const ChildResult done =
      run("results-table",
          {"capture", (folder_ / "work").string(), "personalize,track", "track.mean_mm,none", "",
           "--exclude none", "clothed: --personalize.sequence clothed"},
          R"({"track.mean_mm": 4.25})");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("| | `track.mean_mm` | `none` |\n|---|---|---|\n"
                                  "| default | 4.25 | - |\n| `--exclude none` | 4.25 | - |\n"
                                  "| clothed | 4.25 | - |\n\nCommit: `"));
  const std::string work = (folder_ / "work").string();
  EXPECT_THAT(commands(), HasSubstr("personalize capture " + work +
                                    " --sequence clothed\ntrack "
                                    "capture " +
                                    work + "\nevaluate"));
  EXPECT_THAT(commands(), HasSubstr("track capture " + work + " --exclude none\n"));
}

TEST_F(TableScripts, UnknownOption_IsRefused) {
  const ChildResult refused =
      run("appearance-table", {"capture", (folder_ / "work").string(), "oracle", "--bodi", "true"},
          "{}");
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.err, HasSubstr("--bodi"));
  EXPECT_THAT(refused.out, Not(HasSubstr("all")));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
