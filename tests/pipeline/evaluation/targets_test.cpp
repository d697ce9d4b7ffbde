// Which figures are judged, by what, and what is said of those that are not there.

#include "pipeline/evaluation/targets.h"

#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/file_bytes.h"
#include "pipeline/row/stage_row.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

TEST(DemoRanges, Document_ListsEveryDemoRange) {
  const std::string document =
      read_file_text(source_directory().string() + "/docs/results/demo_ranges.md", 1 << 20);
  int rows = 0;
  for (const Target& target : all_targets()) {
    if (target.demo) {
      EXPECT_THAT(document, HasSubstr("| `" + std::string(target.key) + "` | " +
                                      target_text(target.side, *target.demo) + " |"));
      ++rows;
    }
  }
  EXPECT_GT(rows, 10);
}

TEST(DemoRanges, AbsentRatio_IsNotSaidToBeNone) {
  for (const Target& target : all_targets()) {
    if (target.key == "track.legs_ratio" || target.key == "track.auto_ratio") {
      EXPECT_THAT(std::string(target.absent), HasSubstr("track.dynamic_share"));
    }
  }
}

TEST(DemoRanges, DemoTargets_UseDemoRangesAndExplainAbsence) {
  const TemporaryDirectory root;
  const std::vector<Measure> measures = {
      {"track.mean_mm", 8, "mm", 6, Measure::Side::AtMost, "of something"},
      {"surface.completeness", 0.7, "", 0.95, Measure::Side::AtLeast, ""}};
  const auto verdict = [&](Targets targets, const std::string& key) {
    for (const Judged& row : judged(measures, targets, root.path())) {
      if (row.key == key) {
        return row.verdict + ": " + row.why;
      }
    }
    return std::string();
  };
  EXPECT_EQ(verdict(Targets::Demo, "track.mean_mm"), "met: of something");
  EXPECT_EQ(verdict(Targets::Accuracy, "track.mean_mm"), "missed: of something");
  EXPECT_EQ(verdict(Targets::Demo, "surface.completeness"), "missed: ");
  EXPECT_EQ(verdict(Targets::Accuracy, "material.error"),
            "not measured: there is no result of material");
  double missed_by = 0;
  for (const Judged& row : judged(measures, Targets::Accuracy, root.path())) {
    missed_by += row.missed_by;
  }
  EXPECT_NEAR(missed_by, (8 - 6) + (0.95 - 0.7), 1e-12);
}

TEST(Targets, EveryJudgedFigure_HasARow) {
  const TemporaryDirectory root;
  const std::vector<Measure> measures = {
      {"template.boundaries_wrong", 2, "", 0, Measure::Side::AtMost, "openings"},
      {"template.mean_mm", 2, "mm", 0, Measure::Side::None, ""},
      {"appearance.upper.covered", 0.9, "", 0.95, Measure::Side::AtLeast, ""}};
  std::map<std::string, std::string> verdicts;
  for (const Judged& row : judged(measures, Targets::Accuracy, root.path())) {
    EXPECT_TRUE(verdicts.emplace(row.key, row.stage + " " + row.verdict).second) << row.key;
  }
  EXPECT_EQ(verdicts["template.boundaries_wrong"], "template missed");
  EXPECT_EQ(verdicts["template.not_manifold"], "template not measured");
  EXPECT_EQ(verdicts["appearance.upper.covered"], "appearance missed");
  EXPECT_FALSE(verdicts.contains("template.mean_mm"));
}

TEST(Targets, EveryTarget_HasWordsOfItsOwn) {
  std::map<std::string, std::string> key_of;
  for (const Target& target : all_targets()) {
    const std::string words(target.words);
    EXPECT_GT(words.size(), 10U) << target.key;
    EXPECT_EQ(words.find('_'), std::string::npos) << target.key;
    EXPECT_TRUE(key_of.emplace(words, target.key).second) << target.key << ": " << words;
  }
  for (const StageRow* row : linked_stage_rows()) {
    for (const KeyFigure& figure : row->key_figures) {
      EXPECT_TRUE(key_of.emplace(figure.words, figure.metric).second) << figure.words;
    }
  }
}

TEST(Targets, FigureOfOneGarment_SaysWhose) {
  const TemporaryDirectory root;
  const std::vector<Measure> measures = {
      {"appearance.dress_psnr_db", 30, "dB", 34, Measure::Side::AtLeast, ""},
      {"appearance.psnr_db", 30, "dB", 34, Measure::Side::AtLeast, ""},
      {"capture.seam_mismatch", 0, "", 0.003, Measure::Side::AtMost, "both sides of every seam"}};
  std::map<std::string, std::string> words;
  for (const Judged& row : judged(measures, Targets::Accuracy, root.path())) {
    words[row.key] = row.words;
  }
  EXPECT_EQ(words["appearance.dress_psnr_db"], words["appearance.psnr_db"] + ", of dress alone");
  EXPECT_EQ(words["capture.seam_mismatch"], "");
}

}  // namespace
}  // namespace atelier::fixtures
