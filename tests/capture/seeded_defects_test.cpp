// What goes wrong with captures, seeded into good ones: each defect is found, named where it is,
// and put right by the setting that validate advises. docs/guide/troubleshooting.md is the table:
// ATELIER_WRITE_DOCS=1 test_capture --gtest_filter=SeededDefects.DefectTable_MatchesTheDocument

#include "tests/capture/seeded_defects.h"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/validate.h"
#include "core/io/file_bytes.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

const SeededCapture& good_capture(int rig) {
  static std::map<int, SeededCapture> made;
  const auto found = made.find(rig);
  return found != made.end()
             ? found->second
             : made[rig] = seeded_capture(seeded_rigs()[static_cast<std::size_t>(rig)]);
}

std::string lines(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += to_string(finding) + "\n";
  }
  return text;
}

class SeededDefectTest : public ::testing::TestWithParam<SeededDefect> {};

TEST_P(SeededDefectTest, SeededDefect_IsFoundAndCorrectable) {
  const SeededDefect& defect = GetParam();
  TemporaryDirectory folder;
  write_spoiled(defect, {seeded_rigs()[static_cast<std::size_t>(defect.rig)],
                         good_capture(defect.rig), folder.path()});
  const std::vector<Finding> findings = findings_of(folder.path());
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const Finding& finding) { return names(finding, defect); });
  ASSERT_NE(found, findings.end()) << "findings:\n" << lines(findings);
  EXPECT_FALSE(found->what.empty());
  EXPECT_FALSE(found->advice.empty());
  for (const Finding& finding : findings) {
    EXPECT_FALSE(blames_another(finding, defect)) << to_string(finding);  // more of the same may be
  }
  if (*defect.setting == '\0') {
    return;
  }
  EXPECT_THAT(settings_of(findings), ::testing::Contains(defect.setting)) << lines(findings);
  for (const Finding& finding : findings_of(folder.path(), defect.setting)) {
    EXPECT_NE(finding.severity, Severity::Error) << "with the setting: " << to_string(finding);
    EXPECT_FALSE(names(finding, defect)) << "with the setting: " << to_string(finding);
  }
}

INSTANTIATE_TEST_SUITE_P(Calibration, SeededDefectTest, ::testing::ValuesIn(calibration_defects()));
INSTANTIATE_TEST_SUITE_P(Pictures, SeededDefectTest, ::testing::ValuesIn(picture_defects()));
INSTANTIATE_TEST_SUITE_P(Detections, SeededDefectTest, ::testing::ValuesIn(detection_defects()));

TEST(SeededDefects, GoodCapturesOfOtherSeeds_HaveNoFinding) {
  for (const SeededRig& made : seeded_rigs()) {
    for (const std::uint64_t seed : {made.seed, made.seed + 100, made.seed + 200}) {
      SeededRig rig = made;
      rig.seed = seed;
      TemporaryDirectory folder;
      write_seeded(seeded_capture(rig), folder.path());
      std::vector<Finding> findings = findings_of(folder.path());
      if (!rig.pictures) {
        std::erase_if(findings, [](const Finding& finding) {
          return finding.code == "camera-without-pictures";  // it has none
        });
      }
      EXPECT_EQ(lines(findings), "") << "seed " << seed;
    }
  }
}

constexpr std::string_view kTableHeading = "## Defects that `validate` finds\n\n";

std::string table() {
  std::ostringstream text;
  text << kTableHeading
       << "Seeded one at a time into good synthetic captures (`tests/capture/seeded_*`): 8 cameras "
          "of 72 x 90, 6 of\n112 x 84 with distortion, 9 of 1280 x 1000 with more of it and "
          "detections alone (2.5 px of noise at 1000\nrows, 4% outliers). The test finds each, at "
          "its place and of no other camera; where a setting corrects\nit, the test sets it and "
          "the finding is gone. Good captures of nine seeds have no finding.\n\n"
          "| # | defect | finding | where | setting that corrects it |\n|---|---|---|---|---|\n";
  int number = 0;
  for (const SeededDefect& defect : all_defects()) {
    text << "| " << ++number << " | " << defect.what << " | `" << defect.code << "` | "
         << (*defect.place == '\0' ? "capture" : defect.place) << " | ";
    if (*defect.setting != '\0') {
      text << "`" << defect.setting << "`";
    } else {
      text << "correct the files";
    }
    text << " |\n";
  }
  return text.str();
}

TEST(SeededDefects, DefectTable_MatchesTheDocument) {
  EXPECT_GE(all_defects().size(), 60U);
  const std::filesystem::path file = source_directory() / "docs/guide/troubleshooting.md";
  std::string document = read_file_text(file.string(), 1 << 20);
  const std::size_t heading = document.find(kTableHeading);
  ASSERT_NE(heading, std::string::npos);  // by hand before it, the table behind it
  if (std::getenv("ATELIER_WRITE_DOCS") != nullptr) {
    document = document.substr(0, heading) + table();
    std::ofstream(file) << document;
  }
  EXPECT_EQ(document.substr(heading), table());
}

}  // namespace
}  // namespace atelier::fixtures
