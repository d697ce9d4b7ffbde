// TRC that is written: by the rules of OpenSim's and Pose2Sim's readers, and back by ours.

#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
  }
  return lines;
}

/// Cells between tabs; with `full` only those that hold something, as OpenSim's older readers and
/// its header lines have it.
std::vector<std::string> cells_of(const std::string& line, bool full) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, '\t');) {
    if (!full || !cell.empty()) {
      cells.push_back(cell);
    }
  }
  return cells;
}

/// The first rule of OpenSim's reader that a text breaks; "" where it takes it. Written after the
/// checks of TRCFileAdapter::extendRead (OpenSim 4.5): eight keys in their order and a value for
/// each, "Frame#" and "Time" before as many names as NumMarkers, X1 Y1 Z1 ..., rows of two cells
/// and three a marker, of which every one is a number.
std::string broken_rule(const std::string& text) {
  const std::vector<std::string> lines = lines_of(text);
  if (lines.size() < 7 || cells_of(lines[0], true).at(0) != "PathFileType") {
    return "MissingHeader";
  }
  const std::vector<std::string> keys = {"DataRate",           "CameraRate",   "NumFrames",
                                         "NumMarkers",         "Units",        "OrigDataRate",
                                         "OrigDataStartFrame", "OrigNumFrames"};
  if (cells_of(lines[1], true) != keys) {
    return "UnexpectedMetaDataKey";
  }
  const std::vector<std::string> values = cells_of(lines[2], true);
  if (values.size() != keys.size()) {
    return "MetaDataLengthMismatch";
  }
  const std::size_t markers = std::stoul(values[3]);
  const std::vector<std::string> names = cells_of(lines[3], true);
  if (names.size() != markers + 2 || names[0] != "Frame#" || names[1] != "Time") {
    return "IncorrectNumColumnLabels";
  }
  const std::vector<std::string> axes = cells_of(lines[4], true);
  for (std::size_t i = 0; i < 3 * markers; ++i) {
    if (axes.at(i) != std::string(1, "XYZ"[i % 3]) + std::to_string(i / 3 + 1)) {
      return "UnexpectedColumnLabel";
    }
  }
  std::size_t rows = 0;
  for (std::size_t line = 5; line < lines.size(); ++line) {
    const std::vector<std::string> cells = cells_of(lines[line], true);
    if (cells.empty()) {
      continue;
    }
    if (cells.size() != 2 + 3 * markers) {
      return "RowLengthMismatch";
    }
    if (cells[0] != std::to_string(++rows)) {
      return "a frame that is not the next";
    }
    for (const std::string& cell : cells) {
      std::size_t end = 0;
      std::stod(cell, &end);
      if (end != cell.size()) {
        return "a cell that is no number";
      }
    }
  }
  return std::stoul(values[2]) == rows ? "" : "NumFrames";
}

MarkerClip few_markers() {
  MarkerClip clip;
  clip.name = "walk 1";
  clip.markers = {"LASI", "Ada:RASI", "C7"};
  clip.fps = 30000 / 1001.0;
  for (int i = 0; i < 12; ++i) {
    clip.frame_ids.push_back(100 + i);
    clip.positions.push_back(Points::Constant(3, 3, 0.1 * i - 0.37));
    clip.seen.emplace_back(3, true);
  }
  clip.seen[3][1] = false;
  clip.positions[3].row(1).setZero();
  return clip;
}

TEST(TrcWriting, WhatOpenSimDemands_IsKept) {
  EXPECT_EQ(broken_rule(trc_text(few_markers())), "");
  const std::vector<std::string> lines = lines_of(trc_text(few_markers()));
  EXPECT_EQ(lines[0], "PathFileType\t4\t(X/Y/Z)\twalk_1.trc");
  EXPECT_EQ(cells_of(lines[2], false)[4], "m");
  EXPECT_EQ(lines[5], "");
  EXPECT_THAT(lines[9], HasSubstr("\tNaN\tNaN\tNaN\t"));
  EXPECT_THAT(lines[7], ::testing::StartsWith("2\t0.033367\t"));
  EXPECT_EQ(broken_rule(fixtures::trc_text(few_markers())), "UnexpectedMetaDataKey")
      << "five keys, as others write";
}

// Pose2Sim takes every third cell behind the second for a name, and the rest by columns.
TEST(TrcWriting, WhatPose2SimDemands_IsKept) {
  const std::vector<std::string> lines = lines_of(trc_text(few_markers()));
  const std::vector<std::string> cells = cells_of(lines[3], false);
  std::vector<std::string> names;
  for (std::size_t i = 2; i < cells.size(); i += 3) {
    names.push_back(cells[i]);
  }
  EXPECT_THAT(names, ElementsAre("LASI", "Ada:RASI", "C7"));
  EXPECT_EQ(cells_of(lines[4], false).size(), 2U + 9);
  EXPECT_EQ(cells_of(lines[6], false).size(), 2U + 9);
}

TEST(TrcWriting, WrittenMarkers_ReadBackEqual) {
  const fixtures::TemporaryDirectory folder;
  const MarkerClip clip = few_markers();
  write_trc(folder / "a.trc", clip);
  const MarkerClip back = read_trc(folder / "a.trc");
  EXPECT_TRUE(back.findings.empty());
  EXPECT_EQ(back.markers, clip.markers);
  EXPECT_NEAR(back.fps, clip.fps, 1e-8);
  EXPECT_EQ(back.metres_per_unit, 1);
  EXPECT_EQ(back.seen, clip.seen);
  ASSERT_EQ(back.positions.size(), clip.positions.size());
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    EXPECT_EQ(back.frame_ids[f], static_cast<int>(f) + 1);
    EXPECT_LT((back.positions[f] - clip.positions[f]).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(TrcWriting, SkippedFrames_SkipTimeToo) {
  MarkerClip clip = few_markers();
  clip.fps = 50;
  clip.frame_ids.back() += 5;
  const std::string text = trc_text(clip);
  EXPECT_THAT(lines_of(text).back(), ::testing::StartsWith("17\t0.320000\t"));
  EXPECT_EQ(read_trc(std::as_bytes(std::span(text)), "a.trc").frame_ids.back(), 17);
}

TEST(TrcWriting, JointsOfAMotion_AreMarkersUnderTheirNames) {
  MotionClip clip;
  clip.name = "motion";
  const fixtures::MarkedPerson person = fixtures::marked_person(fixtures::joint_centre_names());
  clip.skeleton = person.skeleton;
  clip.skeleton.names[1] = "mixamorig:Left Hip";
  clip.motion.fps = 60;
  clip.motion.poses = person.poses;
  for (int i = 0; i < std::ssize(person.poses); ++i) {
    clip.motion.frame_ids.push_back(i);
  }
  const fixtures::TemporaryDirectory folder;
  write_motion_file(folder / "motion.trc", clip);
  const MarkerClip back = read_trc(folder / "motion.trc");
  EXPECT_EQ(back.markers[1], "mixamorig_Left_Hip");
  EXPECT_EQ(back.markers.size(), clip.skeleton.names.size());
  const Points joints = forward_kinematics(clip.skeleton, clip.motion.poses[7]).positions;
  EXPECT_LT((back.positions[7] - joints).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(broken_rule(trc_text(joint_markers(clip))), "");
}

TEST(TrcWriting, ClipsWithoutContent_AreRefused) {
  MarkerClip clip = few_markers();
  clip.fps = 0;
  ATELIER_EXPECT_REFUSED(trc_text(clip), LogicError, "a rate");
  clip = few_markers();
  clip.markers.pop_back();
  ATELIER_EXPECT_REFUSED(trc_text(clip), LogicError, "a place for each marker");
  clip = few_markers();
  clip.seen.pop_back();
  ATELIER_EXPECT_REFUSED(trc_text(clip), LogicError, "for each frame");
  ATELIER_EXPECT_REFUSED(trc_text({}), LogicError, "a TRC has markers");
}

}  // namespace
}  // namespace atelier
