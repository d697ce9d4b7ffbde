#include "bodymodel/formats/motion_bvh.h"

#include <algorithm>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/euler.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/rotation.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/support/euler_matrix.h"
#include "tests/support/places.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kPi = std::numbers::pi;

const MotionOptions kMetres{1, 'y', 0};

MotionClip parse_bvh(const std::string& text, const MotionOptions& options = kMetres,
                     const Limits& limits = {}) {
  return read_bvh(std::as_bytes(std::span(text)), "a.bvh", options, limits);
}

// An upper arm and a forearm; `channels` of the elbow and two frames of values.
std::string arm(const std::string& elbow_channels, const std::string& first,
                const std::string& second) {
  return "HIERARCHY\nROOT shoulder\n{\n\tOFFSET 0 1 0\n\tCHANNELS 6 Xposition Yposition Zposition "
         "Zrotation Xrotation Yrotation\n\tJOINT elbow\n\t{\n\t\tOFFSET 0.3 0 0\n\t\tCHANNELS " +
         elbow_channels +
         "\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0.25 0 0\n\t\t}\n\t}\n}\nMOTION\nFrames: 2\n"
         "Frame Time: 0.0083333\n" +
         first + "\n" + second + "\n";
}

std::string good_arm() {
  return arm("3 Zrotation Xrotation Yrotation", "0 1 0 0 0 0 90 0 0", "1 2 3 10 20 30 40 50 60");
}

TEST(Bvh, TreeOffsetsAndMotion_AreRead) {
  const MotionClip clip = parse_bvh(good_arm());
  EXPECT_EQ(clip.skeleton.names, (std::vector<std::string>{"shoulder", "elbow"}));
  EXPECT_EQ(clip.skeleton.parents, (std::vector<int>{-1, 0}));
  EXPECT_EQ(clip.end_sites.size(), 1u);
  EXPECT_EQ(clip.motion.fps, 120);
  ASSERT_EQ(clip.motion.poses.size(), 2u);
  EXPECT_NEAR((clip.motion.poses[0].rotations.row(1) - Eigen::RowVector3d(0, 0, kPi / 2)).norm(), 0,
              1e-12);
  // Positions of the root replace its OFFSET.
  EXPECT_NEAR(clip.motion.poses[0].root_translation.norm(), 0, 1e-15);
  EXPECT_NEAR((clip.motion.poses[1].root_translation - Eigen::Vector3d(1, 1, 3)).norm(), 0, 1e-15);
}

TEST(Bvh, EveryRotationOrder_IsMultipliedInFileOrder) {
  for (const std::string order : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
    std::string channels = "3";
    for (const char axis : order) {
      channels += std::string(" ") + axis + "rotation";
    }
    const MotionClip clip = parse_bvh(arm(channels, "0 0 0 0 0 0 10 -20 70", "0 0 0 0 0 0 0 0 0"));
    const Eigen::Matrix3d expected =
        fixtures::euler_matrix(order, kPi / 180 * Eigen::Vector3d(10, -20, 70));
    EXPECT_LT((rotation_matrix(clip.motion.poses[0].rotations.row(1)) - expected).norm(), 1e-12)
        << order;
  }
}

TEST(Bvh, FewerThanThreeRotationChannels_AreAccepted) {
  EXPECT_NEAR(parse_bvh(arm("1 Yrotation", "0 0 0 0 0 0 45", "0 0 0 0 0 0 0"))
                  .motion.poses[0]
                  .rotations(1, 1),
              kPi / 4, 1e-12);
  EXPECT_EQ(
      parse_bvh(arm("0", "0 0 0 0 0 0", "0 0 0 0 0 0")).motion.poses[0].rotations.row(1).norm(), 0);
}

TEST(Bvh, SixChannelJoints_KeepTheirBones) {
  // Absolute positions, equal to the OFFSET, and changes of it, zero: both leave the bone alone.
  for (const std::string position : {"0.3 0 0", "0 0 0"}) {
    const MotionClip clip =
        parse_bvh(arm("6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                      "0 0 0 0 0 0 " + position + " 90 0 0", "0 0 0 0 0 0 " + position + " 0 0 0"));
    EXPECT_TRUE(clip.findings.empty());
    EXPECT_NEAR(clip.skeleton.offsets(1, 0), 0.3, 1e-15);
    EXPECT_NEAR(clip.motion.poses[0].rotations(1, 2), kPi / 2, 1e-12);
  }
}

TEST(Bvh, StretchingBone_IsReported) {
  const MotionClip clip =
      parse_bvh(arm("6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                    "0 0 0 0 0 0 0.3 0 0 90 0 0", "0 0 0 0 0 0 0.5 0 0 0 0 0"));
  ASSERT_EQ(clip.findings.size(), 1u);
  EXPECT_EQ(clip.findings[0].code, "motion-stretch");
}

MotionClip file_clip(const char* name) {
  return read_bvh(fixtures::source_directory() / "tests/bodymodel/files" / name);
}

// Joints of `clip` at a frame, those of `other` that have its names.
double farthest_joint(const MotionClip& clip, const MotionClip& other, std::size_t frame) {
  const Points a = forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
  const Points b = forward_kinematics(other.skeleton, other.motion.poses[frame]).positions;
  double most = 0;
  for (std::size_t j = 0; j < clip.skeleton.names.size(); ++j) {
    const int joint = find_joint(other.skeleton, clip.skeleton.names[j]);
    most = std::max(most, (a.row(static_cast<Index>(j)) - b.row(joint)).norm());
  }
  return most;
}

// plain.bvh, whose bones stand in OFFSET, and the same person's motion with OFFSET 0 throughout and
// the bones in the position channels; with its path on Hips below a root that stays at 0.
TEST(Bvh, BonesAndPathWhereverTheyStand_GiveTheSameMotion) {
  const MotionClip plain = file_clip("plain.bvh");
  for (const char* name : {"zero_offsets.bvh", "reference.bvh"}) {
    SCOPED_TRACE(name);
    const MotionClip clip = file_clip(name);
    ASSERT_EQ(clip.motion.poses.size(), 12u);
    for (std::size_t frame = 0; frame < 12; ++frame) {
      EXPECT_LT(farthest_joint(plain, clip, frame), 1e-6);
    }
    for (const Finding& finding : clip.findings) {
      EXPECT_NE(finding.code, "motion-stretch");
    }
  }
}

TEST(Bvh, RealStretch_IsStillReported) {
  const std::string text = arm("6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                               "0 1 0 0 0 0 0.3 0 0 0 0 0", "0 1 0 0 0 0 0.6 0 0 0 0 0");
  const MotionClip clip = parse_bvh(text);
  ASSERT_FALSE(clip.findings.empty());
  EXPECT_EQ(clip.findings[0].code, "motion-stretch");
}

TEST(Bvh, SkeletonWithoutBones_IsRefused) {
  const std::string flat =
      "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT b\n{\n"
      "OFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n}\nMOTION\nFrames: 1\n"
      "Frame Time: 0.1\n0 0 0 0 0 0\n";
  EXPECT_THAT([&] { parse_bvh(flat); }, ThrowsMessage<DataError>(HasSubstr("every OFFSET 0")));
}

TEST(Bvh, LengthsBeyondAnyUnit_AreRefused) {
  std::string text = good_arm();
  text.replace(text.find("0.3 0 0"), 3, "1e308");
  EXPECT_THAT([&] { parse_bvh(text); }, ThrowsMessage<DataError>(HasSubstr("OFFSET 1e+308")));
  text = arm("3 Zrotation Xrotation Yrotation", "0 1 0 0 0 0 0 0 0", "1e200 2 3 0 0 0 0 0 0");
  EXPECT_THAT([&] { parse_bvh(text); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("frame 2"), HasSubstr("of shoulder"))));
}

TEST(Bvh, UnusualFormatting_IsAccepted) {
  // Windows line ends, lower case, braces on the name's line, names with blanks, named end sites.
  const MotionClip clip = parse_bvh(
      "hierarchy\r\nroot my hips {\r\noffset 0 0 0\r\nchannels 3 zrotation xrotation yrotation\r\n"
      "end site tip\r\n{ offset 0 1 0 }\r\n}\r\nmotion\r\nframes:\t1\r\nframe time: .04\r\n1 2 3");
  EXPECT_EQ(clip.skeleton.names[0], "my hips");
  EXPECT_EQ(clip.motion.fps, 25);
}

TEST(Bvh, RepeatedNames_AreNumberedAndReported) {
  std::string text = good_arm();
  text.replace(text.find("elbow"), 5, "shoulder");
  const MotionClip clip = parse_bvh(text);
  EXPECT_EQ(clip.skeleton.names[1], "shoulder_2");
  ASSERT_EQ(clip.findings.size(), 1u);
  EXPECT_EQ(clip.findings[0].code, "motion-names");
}

TEST(Bvh, WrittenClip_ReadsBackEqual) {
  MotionClip clip;
  clip.skeleton = fixtures::synthetic_body().skeleton;
  clip.motion.fps = 30;
  for (int frame = 0; frame < 4; ++frame) {
    clip.motion.poses.push_back(fixtures::random_pose(clip.skeleton, frame));
    clip.motion.frame_ids.push_back(frame);
  }
  for (const std::string order : {"ZXY", "XYZ", "YZX"}) {
    BvhWriteOptions options;
    options.order = order;
    const MotionClip back = parse_bvh(bvh_text(clip, options), {0.01, 'y', 0});
    EXPECT_EQ(back.motion.fps, 30);
    for (std::size_t frame = 0; frame < 4; ++frame) {
      const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
      const Points is = forward_kinematics(back.skeleton, back.motion.poses[frame]).positions;
      // BVH nests its joints; compare by name.
      for (std::size_t j = 0; j < back.skeleton.names.size(); ++j) {
        const int k = find_joint(clip.skeleton, back.skeleton.names[j]);
        EXPECT_LT((is.row(static_cast<Index>(j)) - was.row(k)).norm(), 1e-6) << order;
      }
    }
  }
}

TEST(Bvh, WrittenRoot_StandsWhereItsChannelsSayInEveryReader) {
  // Babylon, assimp and Blender replace the root's OFFSET by its positions, three.js adds both.
  MotionClip clip;
  clip.skeleton = fixtures::synthetic_body().skeleton;
  clip.skeleton.offsets.row(0) = Eigen::RowVector3d(0.1, 0.92, 0);
  clip.motion.fps = 30;
  clip.motion.frame_ids = {0};
  clip.motion.poses = {rest_pose(clip.skeleton)};
  const std::string text = bvh_text(clip);
  EXPECT_THAT(text, HasSubstr("{\n\tOFFSET 0.000000 0.000000 0.000000\n\tCHANNELS 6"));
  EXPECT_THAT(text, HasSubstr("\n10.000000 92.000000 0.000000 "));
}

TEST(Bvh, WrittenNames_HaveNoPathsAndNoBlanksAndAreUnique) {
  MotionClip clip = parse_bvh(good_arm());
  clip.skeleton.names = {"mixamorig:Hips", "mixamorig Hips"};
  const std::string text = bvh_text(clip);
  EXPECT_THAT(text, HasSubstr("ROOT mixamorig_Hips\n"));
  EXPECT_THAT(text, HasSubstr("JOINT mixamorig_Hips_2\n"));
  clip.skeleton.names = {"upperarm01.L", "\xC3\x84rm"};
  EXPECT_THAT(bvh_text(clip), AllOf(HasSubstr("ROOT upperarm01.L\n"), HasSubstr("JOINT __rm\n")));
}

TEST(Bvh, WrittenEndSites_HaveALength) {
  MotionClip clip = parse_bvh(good_arm());
  EXPECT_THAT(bvh_text(clip), HasSubstr("\t\t\tOFFSET 25.000000 0.000000 0.000000\n"));
  clip.end_sites.clear();
  EXPECT_THAT(bvh_text(clip), HasSubstr("\t\t\tOFFSET 10.000000 0.000000 0.000000\n"));
  clip.end_sites = {{1, Eigen::Vector3d::Zero()}};
  EXPECT_THAT(bvh_text(clip), HasSubstr("\t\t\tOFFSET 10.000000 0.000000 0.000000\n"));
}

TEST(Bvh, EveryRealFile_IsRead) {
  const std::filesystem::path root = fixtures::test_data_root();
  if (!std::filesystem::exists(root / "mocap_bvh")) {
    GTEST_SKIP() << "no test data at " << root;
  }
  int files = 0;
  for (const char* folder : {"mocap_bvh", "makehuman"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".bvh") {
        continue;
      }
      ++files;
      const MotionClip clip = read_bvh(entry.path());
      EXPECT_NO_THROW(check_motion_clip(clip));
      EXPECT_GE(clip.skeleton.names.size(), 19u);
      // Whatever the file's unit and axes: a person's legs and a person's bones.
      EXPECT_LT(clip.skeleton.offsets.rowwise().norm().maxCoeff(), 1.5) << entry.path();
    }
  }
  EXPECT_EQ(files, 31);
}

TEST(Bvh, CmuWalk_IsScaledFromItsUnit) {
  ATELIER_TEST_FILE(path, "mocap_bvh/fairmotion_cmu/01_01.bvh");
  const MotionClip clip = read_bvh(path);
  EXPECT_EQ(clip.motion.fps, 120);
  EXPECT_EQ(clip.motion.poses.size(), 2752u);
  EXPECT_EQ(clip.findings.at(0).code, "motion-unit");
  EXPECT_NEAR(clip.motion.poses[10].root_translation.y(), 17.8 * 0.0254 / 0.45, 0.05);
}

struct Refusal {
  const char* name;
  std::string text;
  const char* where;
  const char* message;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

class BvhRefusal : public ::testing::TestWithParam<Refusal> {};

TEST_P(BvhRefusal, SpoiledFile_IsRefusedWithLineAndRule) {
  EXPECT_THAT([&] { parse_bvh(GetParam().text); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("a.bvh"), HasSubstr(GetParam().where),
                                             HasSubstr(GetParam().message))));
}

INSTANTIATE_TEST_SUITE_P(
    Files, BvhRefusal,
    ::testing::ValuesIn(std::vector<Refusal>{
        {"Empty", "", "the end of the file", "HIERARCHY"},
        {"NotBvh", "ply\nformat ascii 1.0\n", "'ply'", "HIERARCHY"},
        {"CutInTree", good_arm().substr(0, good_arm().find(" Yposition")), "the end of the file",
         "a channel"},
        {"CutBeforeMotion", replaced(good_arm(), "MOTION", ""), "'Frames:'", "MOTION"},
        {"CutInMotion", good_arm().substr(0, good_arm().size() - 24), "19 bytes of motion",
         "2 frames of 9 values (the file is cut off)"},
        {"CutInLine", good_arm().substr(0, good_arm().size() - 7), "7 values in frame 2",
         "9, one for each channel"},
        {"ManyValues", replaced(good_arm(), "90 0 0", "90 0 0 1"), "10 values in frame 1",
         "9, one for each channel"},
        {"MoreFrames", replaced(good_arm(), "Frames: 2", "Frames: 1"), "more text after frame 1",
         "Frames: says 1"},
        {"HugeFrameCount", replaced(good_arm(), "Frames: 2", "Frames: 900000"), "bytes of motion",
         "900000 frames of 9 values"},
        {"FramesBeyondLimit", replaced(good_arm(), "Frames: 2", "Frames: 2000000"),
         "2000000 frames", "1 to 1000000"},
        {"NoFrames", replaced(good_arm(), "Frames: 2", "Frames: 0"), "0 frames", "1 to"},
        {"NegativeFrames", replaced(good_arm(), "Frames: 2", "Frames: -2"), "-2 frames", "1 to"},
        {"FrameTimeZero", replaced(good_arm(), "0.0083333", "0"), "frame time 0", "more than 0"},
        {"FrameTimeWord", replaced(good_arm(), "0.0083333", "fast"), "'fast'", "the frame time"},
        {"NanValue", replaced(good_arm(), "90 0 0", "nan 0 0"), "value 7 is 'nan'",
         "a finite number"},
        {"InfOffset", replaced(good_arm(), "0.3", "inf"), "'inf'", "a finite number for OFFSET"},
        {"Overflow", replaced(good_arm(), "90 0 0", "1e999 0 0"), "'1e999'", "finite"},
        {"UnknownChannel", replaced(good_arm(), "3 Zrotation", "3 Wrotation"),
         "channel 'Wrotation'", "X, Y or Z"},
        {"ChannelTwice", replaced(good_arm(), "3 Zrotation", "3 Xrotation"),
         "channel 'Xrotation' twice", "each channel once"},
        {"ChannelCount", replaced(good_arm(), "3 Zrotation", "4 Zrotation"), "channel 'End'",
         "position or rotation"},
        {"TooManyChannels", replaced(good_arm(), "3 Zrotation", "7 Zrotation"), "7 channels",
         "0 to 6"},
        {"TwoRoots", replaced(good_arm(), "MOTION", "ROOT second\n{\nOFFSET 0 0 0\n}\nMOTION"),
         "a second ROOT, 'second'", "export each person of the scene alone"},
        {"NoChannelsAtAll",
         "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n\n",
         "no channels", "a joint that moves"},
        {"ChannelsTwice",
         replaced(good_arm(), "\tJOINT elbow", "\tCHANNELS 1 Xrotation\n\tJOINT elbow"),
         "CHANNELS of joint 'shoulder' twice", "CHANNELS once"},
        {"MissingBrace", replaced(good_arm(), "elbow\n\t{", "elbow\n\t"), "", "'{'"},
        {"NulByte", std::string("HIERARCHY\nROOT a\0b\n", 19), "", "NUL"},
    }),
    [](const auto& file) { return std::string(file.param.name); });

TEST(Bvh, LineEndsOfAnyKind_ReadAlike) {
  const MotionClip expected = parse_bvh(good_arm());
  for (const char* end : {"\r\n", "\r"}) {
    std::string text;
    for (const char c : good_arm()) {
      text += c == '\n' ? end : std::string(1, c);
    }
    const MotionClip clip = parse_bvh(text);
    EXPECT_EQ(clip.skeleton.names, expected.skeleton.names);
    ASSERT_EQ(clip.motion.poses.size(), 2U);
    EXPECT_EQ(clip.motion.poses[1].rotations, expected.motion.poses[1].rotations);
  }
}

TEST(Bvh, DecimalCommas_AreNamed) {
  EXPECT_THAT([] { parse_bvh(replaced(good_arm(), "0.0083333", "0,0083333")); },
              ThrowsMessage<DataError>(HasSubstr("'0,0083333' (a decimal comma)")));
  EXPECT_THAT([] { parse_bvh(replaced(good_arm(), "90 0 0", "90,5 0 0")); },
              ThrowsMessage<DataError>(HasSubstr("'90,5' (a decimal comma)")));
  EXPECT_THAT([] { parse_bvh(replaced(good_arm(), "0.25", "0,25")); },
              ThrowsMessage<DataError>(HasSubstr("'0,25' (a decimal comma)")));
}

// One OFFSET of a billion, which no unit makes a person's.
TEST(Bvh, BonesOfNoUnit_AreRefusedWithTheNumber) {
  EXPECT_THAT([] { parse_bvh(replaced(good_arm(), "0.3 0 0", "0 1e9 0"), {}); },
              ThrowsMessage<DataError>(HasSubstr("no unit makes a person's")));
  EXPECT_THAT([] { parse_bvh(replaced(good_arm(), "0.0083333", "1e-320")); },
              ThrowsMessage<DataError>(HasSubstr("frame time 1e-320")));
  EXPECT_EQ(parse_bvh(replaced(good_arm(), "0.0083333", "1e9")).motion.fps, 1e-9);
}

TEST(Bvh, MoreJointsThanTheLimit_AreRefused) {
  Limits limits;
  limits.joints = 1;
  EXPECT_THAT([&] { parse_bvh(good_arm(), kMetres, limits); },
              ThrowsMessage<DataError>(HasSubstr("at most 1")));
}

TEST(Bvh, UnknownRotationOrder_IsRefusedOnWrite) {
  const MotionClip clip = parse_bvh(good_arm());
  BvhWriteOptions options;
  options.order = "XYX";
  EXPECT_THAT([&] { bvh_text(clip, options); },
              ThrowsMessage<LogicError>(HasSubstr("unknown rotation order XYX")));
}

TEST(Bvh, NonFiniteClip_IsRefusedOnWrite) {
  MotionClip clip = parse_bvh(good_arm());
  clip.motion.poses[1].rotations(1, 0) = NAN;
  EXPECT_THAT([&] { bvh_text(clip); }, ThrowsMessage<DataError>(HasSubstr("frame 1")));
}

}  // namespace
}  // namespace atelier
