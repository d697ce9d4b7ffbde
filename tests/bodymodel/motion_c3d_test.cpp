#include "bodymodel/formats/motion_c3d.h"

#include <Eigen/Geometry>
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/marker_fit.h"
#include "bodymodel/formats/marker_names.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/unknown_value.h"
#include "tests/bodymodel/c3d_writer.h"
#include "tests/bodymodel/synthetic_markers.h"
#include "tests/support/places.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::filesystem::path corpus(const char* name) {
  return fixtures::source_directory() / "fuzz/corpus/c3d" / name;
}

TEST(C3d, LittleEndianReals_AreRead) {
  const MarkerClip clip = read_c3d(corpus("small.c3d"));
  EXPECT_EQ(clip.name, "small");
  EXPECT_THAT(clip.markers, ElementsAre("S:LFWT", "S:RFWT", "S:LKNE"));  // "*4" has none
  EXPECT_EQ(clip.fps, 100);
  EXPECT_EQ(clip.metres_per_unit, 0.001);
  EXPECT_THAT(clip.frame_ids, ElementsAre(1, 2, 3));
  EXPECT_NEAR(clip.positions[2](2, 0), 0.2, 1e-9);
  EXPECT_NEAR(clip.positions[2](2, 1), 0.1, 1e-9);
  EXPECT_NEAR(clip.positions[2](2, 2), 0.98, 1e-9);
  EXPECT_THAT(clip.seen[1], ElementsAre(true, false, true));
  EXPECT_TRUE(clip.positions[1].row(1).isZero(0));
}

TEST(C3d, BigEndianIntegers_AreRead) {
  const MarkerClip clip = read_c3d(corpus("whole_big.c3d"));
  EXPECT_EQ(clip.metres_per_unit, 1);
  EXPECT_NEAR(clip.positions[1](2, 0), 200, 1e-4);
  EXPECT_NEAR(clip.positions[1](2, 1), 50, 1e-4);
  EXPECT_NEAR(clip.positions[1](2, 2), 980, 1e-4);
}

TEST(C3d, TruncatedFile_IsRefused) {
  std::vector<std::byte> bytes = read_file_bytes(corpus("small.c3d"), 1 << 20);
  bytes.resize(bytes.size() - 1);
  EXPECT_THAT([&] { read_c3d(bytes, "cut.c3d"); }, ThrowsMessage<DataError>(HasSubstr("cut.c3d")));
  EXPECT_THAT([] { read_c3d(std::span<const std::byte>(), "none.c3d"); },
              ThrowsMessage<DataError>(HasSubstr("none.c3d")));
}

bool has_finding(const std::vector<Finding>& findings, const std::string& code) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& one) { return one.code == code; });
}

// One marker that goes along x, 1 mm a frame.
MarkerClip long_trial(int frames) {
  MarkerClip clip;
  clip.fps = 200;
  clip.markers = {"LASI"};
  for (int i = 0; i < frames; ++i) {
    clip.frame_ids.push_back(i + 1);
    clip.positions.push_back(Points::Constant(1, 3, 0.001 * (i + 1)));
    clip.seen.push_back({true});
  }
  return clip;
}

MarkerClip written_c3d(const MarkerClip& clip, const fixtures::C3dWriteOptions& options = {}) {
  return read_c3d(fixtures::C3dWriter(options).file(clip), "a.c3d");
}

TEST(C3d, NumbersOfEveryProcessor_ReadAlike) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  clip.seen[3][5] = false;
  for (const int processor : {84, 85, 86}) {
    for (const bool real : {true, false}) {
      SCOPED_TRACE(std::to_string(processor) + (real ? " real" : " whole"));
      fixtures::C3dWriteOptions options;
      options.processor = processor;
      options.real = real;
      const MarkerClip back = written_c3d(clip, options);
      EXPECT_EQ(back.markers, clip.markers);
      EXPECT_EQ(back.fps, 60);
      EXPECT_FALSE(back.seen[3][5]);
      ASSERT_EQ(back.positions.size(), clip.positions.size());
      EXPECT_LT((back.positions[20] - clip.positions[20]).cwiseAbs().maxCoeff(),
                real ? 1e-6 : 5.1e-5);
    }
  }
}

TEST(C3d, MoreThan255Names_AreRead) {
  MarkerClip clip = long_trial(2);
  clip.markers.clear();
  for (int i = 0; i < 270; ++i) {
    clip.markers.push_back("M" + std::to_string(i));
  }
  clip.positions.assign(2, Points::Ones(270, 3));
  clip.seen.assign(2, std::vector<bool>(270, true));
  EXPECT_EQ(written_c3d(clip).markers, clip.markers);
}

// Angles have names of joints in some laboratories.
TEST(C3d, ModelledOutputs_AreNoMarkers) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  const auto markers = static_cast<Index>(clip.markers.size());
  clip.markers.insert(clip.markers.end(), {"LAnkle", "RAnkle", "LKneeAngles"});
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    clip.positions[f].conservativeResize(markers + 3, 3);
    clip.positions[f].bottomRows(3).setConstant(0.02);  // degrees taken for millimetres
    clip.seen[f].insert(clip.seen[f].end(), 3, true);
  }
  fixtures::C3dWriteOptions options;
  options.angles = {"LAnkle", "RAnkle", "LKneeAngles"};
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_EQ(back.markers, fixtures::plug_in_gait_names());
  EXPECT_TRUE(has_finding(back.findings, "motion-markers-outputs"));
  const MarkerFit fit = fit_markers(back);
  EXPECT_LT(*std::max_element(fit.rms.begin(), fit.rms.end()), 0.003);
}

// The segments of Theia3D's files, in their order.
std::vector<std::string> theia_segments() {
  return {"worldbody_4X4",  "pelvis_4X4",     "l_thigh_4X4", "l_shank_4X4", "l_foot_4X4",
          "l_toes_4X4",     "r_thigh_4X4",    "r_shank_4X4", "r_foot_4X4",  "r_toes_4X4",
          "torso_4X4",      "l_clavicle_4X4", "l_uarm_4X4",  "l_larm_4X4",  "l_hand_4X4",
          "r_clavicle_4X4", "r_uarm_4X4",     "r_larm_4X4",  "r_hand_4X4",  "neck_4X4",
          "head_4X4"};
}

// Those points of them that have a place on a person.
std::vector<std::string> theia_points() {
  std::vector<std::string> names;
  for (const std::string& segment : theia_segments()) {
    for (const char* point : {"", ".y"}) {
      if (marker_place(segment + point)) {
        names.push_back(segment + point);
      }
    }
  }
  return names;
}

// A file of Theia3D: no points, the world's own segment first, millimetres, Z up, and frames in
// which the person is not there yet (NaN and a residual of -1). Segments whose second axis points
// nowhere known are turned anyhow.
fixtures::C3dWriteOptions theia_options(const MarkerClip& points, int ratio = 1) {
  fixtures::C3dWriteOptions options;
  options.segments = theia_segments();
  options.ratio = ratio;
  const auto place = [&](std::size_t frame, const std::string& name) {
    const auto at = std::find(points.markers.begin(), points.markers.end(), name);
    const Eigen::Vector3d y_up =
        at == points.markers.end()
            ? Eigen::Vector3d::Constant(std::nan(""))
            : Eigen::Vector3d(points.positions[frame].row(at - points.markers.begin()));
    return Eigen::Vector3d(y_up.x(), -y_up.z(), y_up.y());
  };
  for (std::size_t f = 0; f < points.positions.size(); ++f) {
    std::vector<double> row;
    for (const std::string& name : options.segments) {
      const Eigen::Vector3d origin = place(f, name);
      Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
      if (name != "worldbody_4X4") {
        const Eigen::Vector3d ahead = place(f, name + ".y");
        const Eigen::Vector3d y =
            ahead.allFinite() ? (ahead - origin).normalized().eval() : Eigen::Vector3d::UnitY();
        const Eigen::Vector3d x = y.unitOrthogonal();
        matrix.topLeftCorner<3, 3>() << x, y, x.cross(y);
        matrix.topRightCorner<3, 1>() = 1000 * origin;
      }
      row.insert(row.end(), matrix.data(), matrix.data() + 16);
      row.push_back(matrix.allFinite() && points.seen[f][0] ? 0 : -1);
    }
    options.matrices.push_back(std::move(row));
  }
  return options;
}

MarkerClip no_points(std::size_t frames) {
  MarkerClip none;
  none.fps = 60;
  for (std::size_t f = 0; f < frames; ++f) {
    none.frame_ids.push_back(static_cast<int>(f) + 1);
  }
  none.positions.assign(frames, Points::Zero(0, 3));
  none.seen.assign(frames, {});
  return none;
}

TEST(C3d, SegmentsOfTheia3d_AreOriginsAndPointsAhead) {
  MarkerClip points = fixtures::marked_person(theia_points()).clip;
  points.seen[0].assign(points.markers.size(), false);
  const MarkerClip back = written_c3d(no_points(points.positions.size()), theia_options(points));
  EXPECT_EQ(back.fps, 60);
  EXPECT_EQ(back.markers.size(), 40U) << "two of each segment but the world's";
  EXPECT_EQ(back.markers[2], "l_thigh_4X4");
  EXPECT_FALSE(back.seen[0][2]);
  EXPECT_TRUE(back.seen[1][2]);
  EXPECT_FALSE(back.seen[1][20]) << "the left clavicle is NaN";
  for (std::size_t m = 0; m < back.markers.size(); ++m) {
    const auto at = std::find(points.markers.begin(), points.markers.end(), back.markers[m]);
    if (at == points.markers.end() || back.markers[m].ends_with(".y")) {
      continue;
    }
    const Eigen::RowVector3d truth = points.positions[9].row(at - points.markers.begin());
    const Eigen::RowVector3d found = back.positions[9].row(static_cast<Index>(m));
    const Eigen::RowVector3d ahead = back.positions[9].row(static_cast<Index>(m) + 1);
    EXPECT_LT((found - Eigen::RowVector3d(truth.x(), -truth.z(), truth.y())).norm(), 1e-6);
    EXPECT_NEAR((ahead - found).norm(), 0.1, 1e-6);
  }
  const MarkerFit fit = fit_markers(back);
  EXPECT_LT(*std::max_element(fit.rms.begin(), fit.rms.end()), 0.01);
}

TEST(C3d, SeveralMatricesAFrame_AreFramesOfTheirOwn) {
  MarkerClip points = fixtures::marked_person(theia_points()).clip;
  const MarkerClip back = written_c3d(no_points(15), theia_options(points, 2));
  EXPECT_EQ(back.fps, 120);
  ASSERT_EQ(back.positions.size(), 30U);
  EXPECT_EQ(back.frame_ids.back(), 30);
}

TEST(C3d, SegmentsThatAreNone_AreRefused) {
  const MarkerClip points = fixtures::marked_person(theia_points()).clip;
  fixtures::C3dWriteOptions options = theia_options(points);
  const auto refused = [&](const char* words) {
    EXPECT_THAT([&] { written_c3d(no_points(30), options); },
                ThrowsMessage<DataError>(HasSubstr(words)));
  };
  options.matrices[3][17 + 5] = 40;
  refused("a matrix that is none of a segment");
  options = theia_options(points);
  options.segments.assign(21, "worldbody");
  refused("0 names of segments");
  options = theia_options(points);
  options.ratio = 0;
  refused("ROTATION:RATIO");
  options = theia_options(points);
  options.real = false;
  refused("as whole numbers");
  options = {};
  options.numbers = {{"ROTATION", "USED", 2, {17}}};
  refused("names of segments");
}

// As a recording of Qualisys Track Manager has them.
TEST(C3d, NamesOfQualisys_AreUnderstood) {
  std::vector<std::string> names = {"SNJ", "SXS", "TV8", "CV7"};
  for (const std::string side : {"L_", "R_"}) {
    for (const char* name :
         {"IAS", "IPS", "HDF", "HDB", "FTC", "FLE", "FME", "FAX", "TTC", "FAL", "TAM",
          "FCC", "FM1", "FM5", "HM5", "HM2", "UHE", "RSP", "HLE", "HME", "SAJ"}) {
      names.push_back(side + name);
    }
  }
  for (const std::string& name : names) {
    EXPECT_TRUE(marker_place(name).has_value()) << name;
  }
  EXPECT_EQ(marker_place("R_FLE")->offset, marker_place("RKNE")->offset);
  EXPECT_EQ(marker_place("L_IAS")->offset, marker_place("LASI")->offset);
  MarkerClip clip = fixtures::marked_person(names).clip;
  clip.markers.push_back("L_WAND1");
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    clip.positions[f].conservativeResize(std::ssize(names) + 1, 3);
    clip.positions[f].bottomRows(1).setConstant(1);
    clip.seen[f].push_back(true);
  }
  const MarkerFit fit = fit_markers(written_c3d(clip));
  EXPECT_THAT(fit.unknown, ElementsAre("L_WAND1"));
  EXPECT_LT(*std::max_element(fit.rms.begin(), fit.rms.end()), 0.003);
}

TEST(C3d, NanCoordinates_AreUnseen) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  clip.seen[4][7] = false;
  fixtures::C3dWriteOptions options;
  options.nan = true;
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_EQ(back.seen, clip.seen);
  EXPECT_TRUE(back.positions[4].row(7).isZero(0));
}

TEST(C3d, PointsThatAreNeverValid_AreReported) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  const auto reported = [](const MarkerClip& back) {
    return std::any_of(back.findings.begin(), back.findings.end(), [](const Finding& finding) {
      return finding.code == "motion-markers-unseen";
    });
  };
  EXPECT_FALSE(reported(written_c3d(clip)));
  for (std::vector<bool>& seen : clip.seen) {
    seen.assign(seen.size(), false);
  }
  EXPECT_TRUE(reported(written_c3d(clip)));
}

TEST(C3d, MarkerAtExactlyZero_IsUnseenWhereItIsElsewhereLater) {
  MarkerClip clip = long_trial(3);
  clip.positions[1].setZero();
  const MarkerClip back = written_c3d(clip);
  EXPECT_EQ(back.seen, (std::vector<std::vector<bool>>{{true}, {false}, {true}}));
  EXPECT_TRUE(has_finding(back.findings, "motion-markers-zero"));
  clip.positions.assign(3, Points::Zero(1, 3));  // the origin that others are relative to
  EXPECT_EQ(written_c3d(clip).seen, (std::vector<std::vector<bool>>{{true}, {true}, {true}}));
}

bool has_finding(const MarkerClip& clip, const std::string& code) {
  return std::any_of(clip.findings.begin(), clip.findings.end(),
                     [&](const Finding& finding) { return finding.code == code; });
}

TEST(C3d, MarkerAtZeroThroughout_IsUnseenUnlessTheOthersAreAroundIt) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  for (Points& positions : clip.positions) {
    positions.row(3).setZero();
  }
  const MarkerClip back = written_c3d(clip);
  EXPECT_TRUE(has_finding(back, "motion-markers-zero"));
  for (std::size_t frame = 0; frame < back.seen.size(); ++frame) {
    EXPECT_FALSE(back.seen[frame][3]);
    EXPECT_TRUE(back.seen[frame][4]);
  }
  MarkerClip relative = fixtures::marked_person(fixtures::joint_centre_names()).clip;
  for (Points& positions : relative.positions) {  // keypoints relative to a hip
    const Eigen::RowVector3d hip = positions.row(0);
    positions.rowwise() -= hip;
  }
  EXPECT_EQ(written_c3d(relative).seen, relative.seen);
}

TEST(C3d, RatesThatDiffer_AreSaid) {
  const MarkerClip clip = long_trial(3);
  EXPECT_FALSE(has_finding(written_c3d(clip), "motion-rate"));
  fixtures::C3dWriteOptions options;
  options.header_rate = 2 * clip.fps;
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_TRUE(has_finding(back, "motion-rate"));
  EXPECT_NEAR(back.fps, clip.fps, 1e-6);
}

TEST(C3d, MoreFramesThan16BitsHold_AreAllRead) {
  const MarkerClip clip = long_trial(70'000);
  using Numbers = fixtures::C3dWriteOptions::Numbers;
  const std::vector<std::vector<Numbers>> cases = {
      {{"TRIAL", "ACTUAL_START_FIELD", 2, {1, 0}}, {"TRIAL", "ACTUAL_END_FIELD", 2, {4464, 1}}},
      {{"POINT", "LONG_FRAMES", 4, {70'000}}},
      {{"POINT", "FRAMES", 4, {70'000}}},
      {{"POINT", "FRAMES", 2, {4464}}}};  // the file says how many there are
  for (const std::vector<Numbers>& numbers : cases) {
    SCOPED_TRACE(numbers[0].name);
    fixtures::C3dWriteOptions options;
    options.numbers = numbers;
    const MarkerClip back = written_c3d(clip, options);
    ASSERT_EQ(back.positions.size(), 70'000u);
    EXPECT_EQ(back.frame_ids.back(), 70'000);
    EXPECT_NEAR(back.positions.back()(0, 0), 70, 1e-4);
  }
}

TEST(C3d, FieldsOfAnotherTrial_GiveWayToTheHeader) {
  fixtures::C3dWriteOptions options;
  options.numbers = {{"TRIAL", "ACTUAL_START_FIELD", 2, {1, 0}},
                     {"TRIAL", "ACTUAL_END_FIELD", 2, {900, 0}}};
  EXPECT_EQ(written_c3d(long_trial(60), options).positions.size(), 60u);
}

TEST(C3d, LastOffsetWithSwappedBytes_DoesNotLeadIntoTheData) {
  const MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  fixtures::C3dWriteOptions options;
  options.swap_last_offset = true;
  const MarkerClip back = written_c3d(clip, options);
  EXPECT_EQ(back.markers, clip.markers);
  EXPECT_TRUE(has_finding(back.findings, "c3d-parameters"));
}

TEST(C3d, RepeatedNames_AreNumberedAndReported) {
  MarkerClip clip = long_trial(2);
  clip.markers = {"RKNE", "RKNE"};
  clip.positions.assign(2, Points::Ones(2, 3));
  clip.seen.assign(2, {true, true});
  const MarkerClip back = written_c3d(clip);
  EXPECT_THAT(back.markers, ElementsAre("RKNE", "RKNE_2"));
  EXPECT_TRUE(has_finding(back.findings, "motion-markers-names"));
}

TEST(C3d, UnitsInOtherSpellings_AreUnderstood) {
  for (const char* unit : {"M", "meters", "Metre", "[m]", "mete"}) {
    fixtures::C3dWriteOptions options;
    options.unit = unit;
    EXPECT_EQ(written_c3d(long_trial(2), options).metres_per_unit, 1) << unit;
  }
}

// Two people of one recording, and a thing that one of them carries.
MarkerClip two_subjects(const char* second) {
  MarkerClip clip = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  const std::size_t count = clip.markers.size();
  const bool person = std::string(second) != "Ball";
  for (std::size_t m = 0; m < count; ++m) {
    const std::string name = clip.markers[m];
    clip.markers[m] = "Ada:" + name;
    clip.markers.push_back(std::string(second) + ":" + (person ? name : std::to_string(m)));
  }
  for (std::size_t f = 0; f < clip.positions.size(); ++f) {
    Points both(static_cast<Index>(2 * count), 3);
    both << clip.positions[f], clip.positions[f].rowwise() + Eigen::RowVector3d(1.5, 0, 0);
    clip.positions[f] = both;
    clip.seen[f].assign(2 * count, true);
  }
  return clip;
}

TEST(C3d, TwoPeople_AreRefusedUnlessOneIsChosen) {
  const MarkerClip both = written_c3d(two_subjects("Ben"));
  EXPECT_THAT([&] { fit_markers(both); },
              ThrowsMessage<DataError>(
                  ::testing::AllOf(HasSubstr("Ada, Ben"), HasSubstr("--markers.subject 'Ada'"))));
  const MotionClip alone =
      fit_markers(fixtures::marked_person(fixtures::plug_in_gait_names()).clip).clip;
  MarkerFitOptions options;
  for (const char* subject : {"Ada", "Ben"}) {
    options.subject = subject;
    const MotionClip one = fit_markers(both, {}, options).clip;
    const double x =
        one.motion.poses[9].root_translation.x() - alone.motion.poses[9].root_translation.x();
    EXPECT_NEAR(x, std::string(subject) == "Ben" ? 1.5 : 0, 1e-3);
    EXPECT_LT((one.motion.poses[9].rotations - alone.motion.poses[9].rotations).norm(), 1e-2);
  }
  options.subject = "Eve";
  EXPECT_THAT([&] { fit_markers(both, {}, options); },
              ThrowsMessage<UnknownValue>(HasSubstr("subject: 'Eve'; expected one of ")));
}

TEST(C3d, SubjectsOfAFile_AreTold) {
  const MarkerClip alone = fixtures::marked_person(fixtures::plug_in_gait_names()).clip;
  EXPECT_FALSE(subjects_finding(alone));
  const std::string count = std::to_string(alone.markers.size());
  const std::optional<Finding> two = subjects_finding(two_subjects("Ben"));
  ASSERT_TRUE(two);
  EXPECT_EQ(two->severity, Severity::Warning);
  EXPECT_EQ(two->what, "2 people: Ada (" + count + " markers), Ben (" + count + " markers)");
  const std::optional<Finding> one = subjects_finding(two_subjects("Ball"));
  ASSERT_TRUE(one);
  EXPECT_EQ(one->severity, Severity::Note);
  EXPECT_THAT(one->advice, HasSubstr("'Ada' is the person"));
}

TEST(C3d, SubjectThatIsNoPerson_IsLeftOut) {
  const MarkerFit fit = fit_markers(written_c3d(two_subjects("Ball")));
  EXPECT_EQ(fit.used.size(), fixtures::plug_in_gait_names().size());
  EXPECT_TRUE(fit.unknown.empty());
  EXPECT_TRUE(has_finding(fit.clip.findings, "motion-subjects"));
}

// CMU 02_01, "walk", as it was recorded.
TEST(C3d, CmuWalk_MovesTheDefaultHuman) {
  ATELIER_TEST_FILE(path, "mocap_bvh/momentum_c3d/02_01.c3d");
  const MarkerFit fit = fit_markers(read_c3d(path));
  EXPECT_EQ(fit.used.size() + fit.unknown.size(), 41u);
  EXPECT_TRUE(fit.unknown.empty()) << fit.unknown[0];
  double mean = 0;
  for (const double rms : fit.rms) {
    mean += rms / static_cast<double>(fit.rms.size());
  }
  std::printf("%zu frames at %g per second, %.1f mm rms\n", fit.rms.size(), fit.clip.motion.fps,
              1e3 * mean);
  EXPECT_LT(mean, 0.01);
  // The band on this head sits low at the back.
  EXPECT_TRUE(std::any_of(fit.clip.findings.begin(), fit.clip.findings.end(),
                          [](const Finding& one) { return one.code == "motion-markers-head"; }));
  DefaultHumanOptions options = male_human();
  options.shape_basis = false;
  const BodyModel model = default_human(options);
  RetargetOptions retargeting;
  retargeting.fps = 30;
  const Retargeted moved = retarget(fit.clip, model, {}, retargeting);
  const std::vector<Pose>& poses = moved.motion.poses;
  Eigen::Vector3d way = poses.back().root_translation - poses.front().root_translation;
  way.y() = 0;
  const double seconds = static_cast<double>(poses.size() - 1) / 30;
  EXPECT_GT(way.norm() / seconds, 0.8);  // metres a second: a walk
  EXPECT_LT(way.norm() / seconds, 2);
  int left = 0;
  int right = 0;
  for (const auto& standing : moved.contacts) {
    left += standing[0] && !standing[1];
    right += standing[1] && !standing[0];
  }
  EXPECT_GT(left, 5);
  EXPECT_GT(right, 5);
  for (const Pose& pose : {poses.front(), poses[poses.size() / 2], poses.back()}) {
    const Points posed = skin_vertices(model, pose);
    EXPECT_NEAR(posed.col(1).minCoeff(), 0, 0.04);
    EXPECT_NEAR(posed.col(1).maxCoeff(), 1.72, 0.1);
  }
}

}  // namespace
}  // namespace atelier
