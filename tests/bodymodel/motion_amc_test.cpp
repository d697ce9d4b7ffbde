#include "bodymodel/formats/motion_amc.h"

#include <algorithm>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/euler.h"
#include "bodymodel/formats/motion_bvh.h"
#include "bodymodel/formats/motion_trc.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/support/euler_matrix.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kDegree = std::numbers::pi / 180;

const std::string kMotionAmcAsf =
    ":version 1.10\n:name VICON\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n:documentation\n"
    "   anything\n:root\n   order TX TY TZ RX RY RZ\n   axis XYZ\n   position 0 0 0\n"
    "   orientation 0 0 0\n:bonedata\n  begin\n     id 1\n     name thigh\n     direction 0 -1 0\n"
    "     length 7\n     axis 0 0 20 XYZ\n    dof rx ry rz\n    limits (-160 20)\n"
    "           (-70 70)\n           (-60 70)\n  end\n  begin\n     id 2\n     name shin\n"
    "     direction 0 -0.6 0.8\n     length 8\n     axis 10 20 30 XYZ\n    dof rx\n  end\n"
    ":hierarchy\n  begin\n    root thigh\n    thigh shin\n  end\n";
const std::string kAmc =
    "#!OML:ASF x\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 10 20 30\nthigh 5 6 7\nshin 40\n2\n"
    "root 1 2 3 0 0 0\nthigh 0 0 0\nshin 0\n";

MotionClip parse_amc(const std::string& asf, const std::string& amc,
                     const MotionOptions& options = {1, 'y', 0}) {
  return read_amc(std::as_bytes(std::span(asf)), "a.asf", std::as_bytes(std::span(amc)), "a.amc",
                  options);
}

TEST(Amc, Joints_AreAtTheStartOfBones) {
  const MotionClip clip = parse_amc(kMotionAmcAsf, kAmc);
  EXPECT_EQ(clip.skeleton.names, (std::vector<std::string>{"root", "thigh", "shin"}));
  const Points rest = rest_positions(clip.skeleton);
  EXPECT_NEAR(rest.row(1).norm(), 0, 1e-15);
  EXPECT_NEAR((rest.row(2) - Eigen::RowVector3d(0, -7, 0)).norm(), 0, 1e-12);
  ASSERT_EQ(clip.end_sites.size(), 1u);
  EXPECT_NEAR((clip.end_sites[0].offset - Eigen::Vector3d(0, -4.8, 6.4)).norm(), 0, 1e-12);
  EXPECT_EQ(clip.motion.fps, 120);
  EXPECT_EQ(clip.findings.at(0).code, "motion-fps");
}

TEST(Amc, Rotations_AreInTheBoneAxes) {
  const MotionClip clip = parse_amc(kMotionAmcAsf, kAmc);
  // C from "axis 10 20 30 XYZ" turns about x first; M is about the bone's x alone.
  const Eigen::Matrix3d c = fixtures::euler_matrix("ZYX", kDegree * Eigen::Vector3d(30, 20, 10));
  const Eigen::Matrix3d expected = c * axis_rotation(0, 40 * kDegree) * c.transpose();
  EXPECT_LT((rotation_matrix(clip.motion.poses[0].rotations.row(2)) - expected).norm(), 1e-12);
  const Eigen::Matrix3d root = fixtures::euler_matrix("ZYX", kDegree * Eigen::Vector3d(30, 20, 10));
  EXPECT_LT((rotation_matrix(clip.motion.poses[0].rotations.row(0)) - root).norm(), 1e-12);
  EXPECT_EQ(clip.motion.poses[0].root_translation, Eigen::Vector3d(1, 2, 3));
}

TEST(Amc, CmuFile_IsReadUpright) {
  ATELIER_TEST_FILE(asf, "mocap_bvh/fairmotion_cmu/11.asf");
  const MotionClip clip = read_amc(asf, asf.parent_path() / "11_01.amc");
  const Humanoid person = recognised_humanoid(clip.skeleton);
  EXPECT_NEAR(leg_length(clip.skeleton, person), 0.83, 0.1);
  for (std::size_t i = 0; i < clip.motion.poses.size(); i += 20) {
    const Points joints = forward_kinematics(clip.skeleton, clip.motion.poses[i]).positions;
    EXPECT_GT(joints(person.neck.back(), 1), 1.2);
    EXPECT_LT(joints(person.legs[0].ankle, 1), 0.5);
    EXPECT_GT(joints(person.legs[0].ankle, 1), -0.1);
  }
}

struct AmcRefusalCase {
  const char* name;
  bool in_asf;
  const char* from;
  const char* to;
  const char* message;
};

class AmcRefusal : public ::testing::TestWithParam<AmcRefusalCase> {};

TEST_P(AmcRefusal, SpoiledFile_IsRefusedWithItsLine) {
  std::string asf = kMotionAmcAsf;
  std::string amc = kAmc;
  std::string& text = GetParam().in_asf ? asf : amc;
  text.replace(text.find(GetParam().from), std::string(GetParam().from).size(), GetParam().to);
  EXPECT_THAT(
      [&] { parse_amc(asf, amc); },
      ThrowsMessage<DataError>(AllOf(HasSubstr(GetParam().in_asf ? "a.asf: line" : "a.amc: line"),
                                     HasSubstr(GetParam().message))));
}

const AmcRefusalCase kAmcCases[] = {
    {"NotAsf", true, ":version 1.10", "hello", "an ASF file"},
    {"UnknownSection", true, ":name", ":nme", "section ':nme'"},
    {"UnknownAngle", true, "angle deg", "angle grad", "deg or rad"},
    {"RootOrder", true, "TX TY", "QX TY", "degree of freedom 'QX'"},
    {"BoneWithoutLength", true, "     length 7\n", "", "without all of its fields"},
    {"BoneWithoutAxis", true, "     axis 0 0 20 XYZ\n", "", "without all of its fields"},
    {"DirectionNotUnit", true, "0 -1 0", "0 -2 0", "unit direction"},
    {"NanLength", true, "length 7", "length nan", "'nan'"},
    {"AxisOrder", true, "0 0 20 XYZ", "0 0 20 XYX", "the letters X, Y and Z"},
    {"UnknownDof", true, "dof rx ry rz", "dof tx ry rz", "degree of freedom 'tx'"},
    {"ManyDofs", true, "dof rx ry rz", "dof rx ry rz rx", "more than three"},
    {"BoneTwice", true, "name shin", "name thigh", "'thigh' twice"},
    {"UnknownField", true, "id 1", "colour 1", "a field of a bone"},
    {"UnknownParent", true, "thigh shin", "thumb shin", "bone 'thumb'"},
    {"UnknownChild", true, "thigh shin", "thigh foot", "bone 'foot'"},
    {"TwoParents", true, "thigh shin", "root shin\n thigh shin", "two parents"},
    {"Loose", true, "    thigh shin\n", "", "does not hang on the root"},
    {"Cycle", true, "root thigh", "shin thigh", "does not hang on the root"},
    {"CutInBone", true, "  end\n:hierarchy\n  begin\n    root thigh\n    thigh shin\n  end\n", "",
     "the end of the file in bone 'shin'"},
    {"UnknownBone", false, "shin 40", "tail 40", "bone 'tail'"},
    {"MissingBone", false, "shin 40\n", "", "no bone 'shin' in frame 1"},
    {"BoneTwiceInFrame", false, "shin 40\n", "shin 40\nshin 40\n", "twice in frame 1"},
    {"FewValues", false, "thigh 5 6 7", "thigh 5 6", "a degree of freedom"},
    {"ManyValues", false, "shin 40", "shin 40 41", "more values"},
    {"NanValue", false, "shin 40", "shin nan", "'nan'"},
    {"FramesBackwards", false, "\n2\n", "\n1\n", "increasing frame numbers"},
    {"NoFrameNumber", false, "\n1\nroot", "\nroot", "a frame number before"},
};

INSTANTIATE_TEST_SUITE_P(Files, AmcRefusal, ::testing::ValuesIn(kAmcCases),
                         [](const auto& file) { return std::string(file.param.name); });

TEST(Amc, EmptyFile_IsRefused) {
  EXPECT_THAT([] { parse_amc(kMotionAmcAsf, ""); },
              ThrowsMessage<DataError>(HasSubstr("no frames")));
  EXPECT_THAT([] { parse_amc("", kAmc); }, ThrowsMessage<DataError>(HasSubstr("no bones")));
}

const std::string kTrc =
    "PathFileType\t4\t(X/Y/Z)\ta.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\n"
    "60\t60\t2\t2\tmm\t60\n"
    "Frame#\tTime\tRHip\t\t\tLHip\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
    "1\t0\t100\t200\t300\t1\t2\t3\n"
    "2\t0.1\t\t\t\t4\t5\t6\t\n";

MarkerClip parse_trc(const std::string& text) {
  return read_trc(std::as_bytes(std::span(text)), "a.trc");
}

TEST(Trc, MetresAndGaps_AreRead) {
  const MarkerClip clip = parse_trc(kTrc);
  EXPECT_EQ(clip.markers, (std::vector<std::string>{"RHip", "LHip"}));
  EXPECT_EQ(clip.fps, 60);
  EXPECT_NEAR((clip.positions[0].row(0) - Eigen::RowVector3d(0.1, 0.2, 0.3)).norm(), 0, 1e-15);
  EXPECT_FALSE(clip.seen[1][0]);
  EXPECT_TRUE(clip.seen[1][1]);
  EXPECT_EQ(clip.positions[1].row(0).norm(), 0);
}

std::string with_cells(const std::string& cells) {
  std::string text = kTrc;
  return text.replace(text.find("\t100\t200\t300"), 12, cells);
}

TEST(Trc, LinesThatEndInCrAlone_AreRead) {
  std::string text = kTrc;
  std::replace(text.begin(), text.end(), '\n', '\r');
  const MarkerClip clip = parse_trc(text);
  EXPECT_EQ(clip.markers, parse_trc(kTrc).markers);
  EXPECT_EQ(clip.positions, parse_trc(kTrc).positions);
}

TEST(Trc, DecimalCommas_AreNamed) {
  EXPECT_THAT(
      [] { parse_trc(with_cells("\t100,5\t200,0\t300")); },
      ThrowsMessage<DataError>(AllOf(HasSubstr("line 6"), HasSubstr("'100,5' (a decimal comma)"))));
}

TEST(Trc, EveryWordForNoNumber_IsUnseen) {
  for (const char* word :
       {"", "nan", "NaN", "NAN", "Nan", "-nan", "nan(ind)", "-1.#IND", "1.#QNAN", "NA", "null"}) {
    SCOPED_TRACE(word);
    const std::string cell = std::string("\t") + word;
    const MarkerClip clip = parse_trc(with_cells(cell + cell + cell));
    EXPECT_FALSE(clip.seen[0][0]);
    EXPECT_TRUE(clip.seen[0][1]);
    EXPECT_TRUE(clip.positions[0].row(0).isZero(0));
  }
}

TEST(Trc, StrippedTabs_AreMarkersUnseen) {
  std::string text = kTrc;
  text.replace(text.find("\t300\t1\t2\t3"), 10, "\t300");
  const MarkerClip clip = parse_trc(text);
  EXPECT_TRUE(clip.seen[0][0]);
  EXPECT_FALSE(clip.seen[0][1]);
  text.replace(text.find("\t300"), 4, "");  // a part of a marker
  EXPECT_THAT([&] { parse_trc(text); }, ThrowsMessage<DataError>(HasSubstr("4 cells; expected 8")));
}

TEST(Trc, LinesOfTabs_AreBlank) {
  std::string text = kTrc;
  text.insert(text.find("\n2\t0.1"), "\n\t\t\t\t\t\t\t\t");
  EXPECT_EQ(parse_trc(text).positions.size(), 2u);
}

TEST(Trc, Blanks_PartCellsToo) {
  const MarkerClip clip = parse_trc(
      "PathFileType 4 (X/Y/Z) a.trc\nDataRate CameraRate NumFrames NumMarkers Units\n"
      "60   60 2 2 MM\nFrame# Time RHip LHip\n X1 Y1 Z1 X2 Y2 Z2\n"
      "  1  0  100 200 300  1 2 3\n  2  0.1  NaN NaN NaN  4 5 6 \n");
  EXPECT_EQ(clip.markers, (std::vector<std::string>{"RHip", "LHip"}));
  EXPECT_NEAR(clip.positions[0](0, 2), 0.3, 1e-15);
  EXPECT_FALSE(clip.seen[1][0]);
  EXPECT_NEAR(clip.positions[1](1, 2), 0.006, 1e-15);
}

TEST(Trc, CommasOfASpreadsheet_PartCells) {
  std::string text = kTrc;
  std::replace(text.begin(), text.end(), '\t', ',');
  const MarkerClip clip = parse_trc(text + ",,,,,,,\n");
  EXPECT_EQ(clip.markers, (std::vector<std::string>{"RHip", "LHip"}));
  EXPECT_FALSE(clip.seen[1][0]);
  EXPECT_NEAR(clip.positions[1](1, 2), 0.006, 1e-15);
}

TEST(Trc, MarkersAtExactlyZero_AreUnseen) {
  const MarkerClip clip = parse_trc(with_cells("\t0\t0\t0"));
  EXPECT_TRUE(clip.seen[0][0]);  // never anywhere else: keypoints may be relative to it
  std::string text = with_cells("\t0\t0\t0");
  text.replace(text.find("\t\t\t\t4"), 4, "\t7\t8\t9");
  EXPECT_FALSE(parse_trc(text).seen[0][0]);
}

TEST(Trc, CountsThatDisagree_AreBothNamed) {
  const auto refused = [](const char* from, const char* to, const char* found,
                          const char* expected) {
    std::string text = kTrc;
    text.replace(text.find(from), std::string(from).size(), to);
    EXPECT_THAT([&] { parse_trc(text); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(found), HasSubstr(expected))));
  };
  refused("\t2\t2\t", "\t2\t3\t", "2 names of markers", "3, as NumMarkers says in line 3");
  refused("\t2\t2\t", "\t60\t2\t", "2 rows of frames", "60, as NumFrames says in line 3");
  refused("\t2\t2\t", "\t1\t2\t", "2 rows of frames", "1, as NumFrames says in line 3");
}

TEST(Trc, TimesOfAnotherRate_AreReported) {
  MarkerClip clip = fixtures::marked_person(fixtures::joint_centre_names()).clip;
  std::string text = fixtures::trc_text(clip);
  EXPECT_TRUE(parse_trc(text).findings.empty());
  text.replace(text.find("60\t60"), 2, "30");
  const MarkerClip back = parse_trc(text);
  ASSERT_EQ(back.findings.size(), 1u);
  EXPECT_EQ(back.findings[0].code, "motion-rate");
}

TEST(Trc, RateOfZero_IsThatOfTheColumnTime) {
  std::string text = kTrc;
  text.replace(text.find("60\t60"), 2, "0");
  const MarkerClip clip = parse_trc(text);
  EXPECT_EQ(clip.fps, 10);
  ASSERT_EQ(clip.findings.size(), 1u);
  EXPECT_EQ(clip.findings[0].code, "motion-rate");
  for (const char* time : {"0", "x", "-0.1", "1e-300", "1e300"}) {
    SCOPED_TRACE(time);
    std::string still = text;
    still.replace(still.find("\t0.1"), 4, std::string("\t") + time);
    EXPECT_THAT([&] { parse_trc(still); },
                ThrowsMessage<DataError>(HasSubstr("no column Time that goes on")));
  }
}

// OpenSim's Rajagopal model comes with such files.
TEST(Trc, HeaderLinedUpByTabs_IsRead) {
  std::string text = kTrc;
  text.replace(text.find("60\t60\t2\t2\tmm\t60"), 15, "  60.0\t\t  60.0\t\t 2\t\t 2\t\t mm\t 60.0");
  text.replace(0, 15, "\xEF\xBB\xBFPathFileType  4\t");
  const MarkerClip clip = parse_trc(text);
  EXPECT_EQ(clip.fps, 60);
  EXPECT_EQ(clip.positions.size(), 2u);
  EXPECT_NEAR(clip.positions[0](0, 2), 0.3, 1e-15);
}

TEST(Trc, RealFile_IsRead) {
  ATELIER_TEST_FILE(file,
                    "pose2sim_demo/single/pose-3d_reference/S00_P00_T01_BalancingTrial_0-100.trc");
  const MarkerClip clip = read_trc(file);
  EXPECT_EQ(clip.markers.size(), 21u);
  EXPECT_EQ(clip.positions.size(), 100u);
  EXPECT_NEAR(clip.positions[0](0, 1), 0.9015, 1e-4);
}

TEST(Trc, MalformedFiles_AreRefused) {
  const auto refused = [](const char* from, const char* to, const char* message) {
    std::string text = kTrc;
    text.replace(text.find(from), std::string(from).size(), to);
    EXPECT_THAT([&] { parse_trc(text); },
                ThrowsMessage<DataError>(AllOf(HasSubstr("a.trc: line"), HasSubstr(message))));
  };
  refused("PathFileType", "Path", "a TRC file");
  refused("\tmm\t", "\tly\t", "unit 'ly'");
  refused("Units", "Unit", "no Units");
  refused("60\t60", "-1\t60", "DataRate");
  refused("60\t60", "x\t60", "'x'");
  refused("\t2\t2\t", "\t0\t2\t", "a whole number for NumFrames");
  refused("\t2\t2\t", "\t2\t3\t", "3, as NumMarkers says");
  refused("\t2\t2\t", "\t1\t2\t", "as NumFrames says");
  refused("\t2\t2\t", "\t3\t2\t", "the file is cut off");
  refused("\t2\t2\t", "\t900000\t2\t", "the file is cut off");
  refused("LHip", "RHip", "'RHip' twice");
  refused("100\t200", "100", "cells");
  refused("100\t200", "inf\t200", "'inf'");
  refused("\n2\t0.1", "\n1\t0.1", "increasing frame numbers");
}

}  // namespace
}  // namespace atelier
