// People who walk: followed by keypoints and scans, with what goes wrong in captures.
#include "bodymodel/tracking/track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "tests/bodymodel_tracking/posed_person.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

TrackInput walk(int frames, double noise, double fps = 30) {
  Random random{3};
  TrackInput input;
  input.keypoint_names = body_25_names();
  input.fps = fps;
  for (int f = 0; f < frames; ++f) {
    const FrameTargets seen =
        keypoints_of(fitted_human(), walking(fitted_human(), f / fps), noise, random);
    input.frame_ids.push_back(f);
    input.frames.push_back({seen.keypoints, seen.deviations, {}});
  }
  return input;
}

ScanPoints body_scan(double seconds) {
  return scan_of(walking(fitted_human(), seconds));
}

double error_of(const Tracking& tracking, std::size_t f, double seconds) {
  return joint_error(fitted_human(),
                     pose_variables(fitted_human(), tracking.tracked.motion.poses[f]),
                     walking(fitted_human(), seconds));
}

TEST(Track, Keypoints_AreTracked) {
  const Tracking tracking = track(plain_human(), walk(20, 0.008));
  double mean = 0;
  for (std::size_t f = 0; f < 20; ++f) {
    EXPECT_LT(error_of(tracking, f, f / 30.0), 0.015);
    mean += error_of(tracking, f, f / 30.0) / 20;
    EXPECT_EQ(tracking.tracked.trusted[f], 1);
  }
  EXPECT_LT(mean, 0.009);
  // The uncertainty that it states is about the error that it has.
  EXPECT_GT(tracking.tracked.deviations.mean(), 0.002);
  EXPECT_LT(tracking.tracked.deviations.mean(), 0.012);
  EXPECT_TRUE(tracking.findings.empty());
}

// Detectors put a hip where no joint is, in every frame.
TEST(Track, ConstantKeypointOffset_RaisesTheStandardDeviation) {
  const auto deviation = [](double beside, bool scanned) {
    TrackInput input = walk(12, 0.004);
    for (std::size_t f = 0; f < 12; ++f) {
      for (Index k = 0; k < input.frames[f].keypoints.rows(); ++k) {
        const std::string& name = input.keypoint_names[static_cast<std::size_t>(k)];
        if (name == "left_hip" || name == "right_hip") {
          input.frames[f].keypoints(k, 1) += beside;
        }
      }
      if (scanned) {
        input.frames[f].scan = body_scan(static_cast<double>(f) / 30);
      }
    }
    const TrackedMotion tracked = track(plain_human(), input).tracked;
    return tracked.deviations(6, find_joint(tracked.skeleton, "left_hip"));
  };
  const double right = deviation(0, false);
  const double wrong = deviation(0.05, false);
  EXPECT_LT(right, 0.01);
  EXPECT_GT(wrong, 2 * right);
  EXPECT_LT(wrong, 0.06);
  EXPECT_LT(deviation(0.05, true), right) << "a scan says where it is";
}

TEST(Track, Scans_MakeTrackingExact) {
  TrackInput input = walk(4, 0.012, 12);
  for (std::size_t f = 0; f < 4; ++f) {
    input.frames[f].scan = body_scan(f / 12.0);
  }
  TrackOptions options;
  options.samples = 1500;
  const Tracking with = track(plain_human(), input, options);
  double mean = 0;
  for (std::size_t f = 0; f < 4; ++f) {
    mean += error_of(with, f, f / 12.0) / 4;
    EXPECT_LT(with.tracked.scan_rms[static_cast<Index>(f)], 0.003);
    EXPECT_GT(with.tracked.scan_share[static_cast<Index>(f)], 0.9);
  }
  EXPECT_LT(mean, 0.004);
}

TEST(Track, AnyThreadCount_GivesTheSameDigits) {
  TrackInput input = walk(10, 0.01);
  input.frames[4].scan = body_scan(4 / 30.0);
  TrackOptions options;
  options.window = 4;
  options.overlap = 2;
  options.rounds = 1;
  options.samples = 300;
  std::vector<Points> first;
  for (const int threads : {1, 2, 5}) {
    set_thread_count(threads);
    const Tracking tracking = track(plain_human(), input, options);
    if (first.empty()) {
      first = tracking.tracked.joints;
    }
    for (std::size_t f = 0; f < first.size(); ++f) {
      EXPECT_EQ(tracking.tracked.joints[f], first[f]);
    }
  }
  set_thread_count(0);
}

// Detectors put joints beside where they are, which one or two frames do not show.
TEST(Track, FewFramesWithoutScans_StateTheUsualDetectorBias) {
  const auto deviation = [](int frames, bool scanned) {
    TrackInput input = walk(frames, 0.004);
    for (std::size_t f = 0; scanned && f < input.frames.size(); ++f) {
      input.frames[f].scan = body_scan(static_cast<double>(f) / 30);
    }
    const TrackedMotion tracked = track(plain_human(), input).tracked;
    return tracked.deviations.minCoeff();
  };
  for (const int frames : {1, 2}) {
    EXPECT_GT(deviation(frames, false), 0.02);
    EXPECT_LT(deviation(frames, true), 0.01) << "a scan says where it is";
  }
  EXPECT_LT(deviation(3, false), 0.01) << "three show that these are right";
}

TEST(Track, KeypointsInOtherUnits_GiveOneFindingAndAreMissing) {
  TrackInput input = walk(6, 0.004);
  input.frames[1].keypoints *= 1000;
  input.frames[4].keypoints *= 1000;
  const Tracking tracking = track(plain_human(), input);
  EXPECT_THAT(tracking.findings, Contains(AllOf(Field(&Finding::code, "keypoint-unit"),
                                                Field(&Finding::place, "frames 1, 4"))));
  EXPECT_THAT(tracking.findings, Not(Contains(Field(&Finding::code, "keypoints-missing"))));
  EXPECT_EQ(tracking.tracked.keypoint_rms[1], 0);
  EXPECT_EQ(tracking.tracked.trusted, (std::vector<char>{1, 0, 1, 1, 0, 1}));
  EXPECT_LT(error_of(tracking, 4, 4 / 30.0), 0.03);
}

TEST(Track, FrameWithoutKeypoints_IsBridgedAndUntrusted) {
  TrackInput input = walk(9, 0.004);
  input.frames[4].keypoints.resize(0, 3);
  input.frames[4].deviations.resize(0);
  const Tracking tracking = track(plain_human(), input);
  EXPECT_EQ(tracking.tracked.trusted[4], 0);
  EXPECT_EQ(tracking.tracked.trusted[3], 1);
  EXPECT_LT(error_of(tracking, 4, 4 / 30.0), 0.02);
  EXPECT_GT(tracking.tracked.deviations.row(4).mean(), tracking.tracked.deviations.row(2).mean());
  EXPECT_THAT(tracking.findings, Contains(Field(&Finding::code, "keypoints-missing")));
  EXPECT_THAT(tracking.findings, Contains(Field(&Finding::code, "frame-untrusted")));
}

TEST(Track, ManyUntrustedFrames_GiveOneFinding) {
  TrackInput input = walk(14, 0.004);
  for (std::size_t f = 2; f < 12; ++f) {
    input.frames[f].deviations.setZero();
  }
  const Tracking tracking = track(plain_human(), input);
  const auto is_untrusted = [](const Finding& one) { return one.code == "frame-untrusted"; };
  ASSERT_EQ(std::count_if(tracking.findings.begin(), tracking.findings.end(), is_untrusted), 1);
  EXPECT_EQ(std::find_if(tracking.findings.begin(), tracking.findings.end(), is_untrusted)->place,
            "frames 2, 3, 4, 5, 6, 7, 8, 9 and 2 others");
}

TEST(Track, MissingKeypoints_AreReplacedByAScan) {
  TrackInput input = walk(5, 0.004, 12);
  input.frames[2].keypoints.resize(0, 3);
  input.frames[2].deviations.resize(0);
  input.frames[2].scan = body_scan(2 / 12.0);
  const Tracking tracking = track(plain_human(), input);
  EXPECT_EQ(tracking.tracked.trusted[2], 1);
  EXPECT_LT(error_of(tracking, 2, 2 / 12.0), 0.012);
}

// Frames a second apart: between the poses before and behind, arms are where nobody holds them.
TEST(Track, ScanWithAnArmOff_LeavesTheFrameUntrusted) {
  TrackInput input = walk(3, 0.004, 1);
  input.frames[1].keypoints.resize(0, 3);
  input.frames[1].deviations.resize(0);
  input.frames[1].scan = scan_of(
      turned(turned(walking(fitted_human(), 1), "left_shoulder", 2.4), "right_shoulder", -2.4));
  const Tracking tracking = track(plain_human(), input);
  EXPECT_GT(tracking.tracked.scan_share[1], 0.5) << "trunk and legs agree";
  EXPECT_EQ(tracking.tracked.trusted, (std::vector<char>{1, 0, 1}));
  EXPECT_GT(tracking.tracked.deviations.row(1).minCoeff(), 0.05);
  EXPECT_THAT(tracking.findings, Contains(Field(&Finding::code, "frame-untrusted")));
}

TEST(Track, ContradictoryKeypoints_AreUntrusted) {
  TrackInput input = walk(7, 0.004);
  Random random{4};
  for (Index k = 0; k < input.frames[3].keypoints.rows(); ++k) {
    input.frames[3].keypoints.row(k) +=
        0.6 * Eigen::RowVector3d(normal(random), normal(random), normal(random));
  }
  const Tracking tracking = track(plain_human(), input);
  EXPECT_EQ(tracking.tracked.trusted[3], 0);
  EXPECT_LT(error_of(tracking, 3, 3 / 30.0), 0.03);
}

TEST(Track, PosesMissingTheirKeypoints_AreUntrusted) {
  // Frames said to be ten times as close in time as they are: accelerations hold the person still.
  TrackInput input = walk(8, 0.004, 12);
  input.fps = 120;
  const Tracking tracking = track(plain_human(), input);
  EXPECT_THAT(tracking.tracked.trusted, Contains(0));
  for (Index f = 0; f < 8; ++f) {
    const double off = tracking.tracked.keypoint_rms[f];
    EXPECT_EQ(tracking.tracked.trusted[static_cast<std::size_t>(f)], off < 0.06 ? 1 : 0) << off;
    if (off >= 0.06) {
      EXPECT_GT(tracking.tracked.deviations.row(f).minCoeff(), 0.99 * off);
    }
  }
  EXPECT_THAT(tracking.findings,
              Contains(AllOf(Field(&Finding::code, "keypoints-unmet"),
                             Field(&Finding::advice, HasSubstr("120 frames a second")))));
  EXPECT_THAT(tracking.findings, Not(Contains(Field(&Finding::code, "frame-untrusted"))));
}

TEST(Track, SingleUnreachableKeypoint_CostsNoTrust) {
  TrackInput input = walk(5, 0.004);
  const auto& names = input.keypoint_names;
  const auto wrist = std::find(names.begin(), names.end(), "left_wrist") - names.begin();
  input.frames[2].keypoints(wrist, 0) += 0.8;
  const Tracking tracking = track(plain_human(), input);
  EXPECT_GT(tracking.tracked.keypoint_rms[2], 0.06);
  EXPECT_THAT(tracking.tracked.trusted, ::testing::Each(1));
}

TEST(Track, NothingSeen_IsUntrusted) {
  TrackInput input = walk(3, 0);
  for (TrackFrame& frame : input.frames) {
    frame.keypoints.resize(0, 3);
    frame.deviations.resize(0);
  }
  const Tracking tracking = track(plain_human(), input);
  EXPECT_THAT(tracking.tracked.trusted, ::testing::Each(0));
}

TEST(Track, ScanInMillimetres_IsLeftOut) {
  TrackInput input = walk(3, 0.004);
  input.frames[1].scan = body_scan(1 / 30.0);
  input.frames[1].scan.points *= 1000;
  input.frames[1].scan.areas *= 1e6;
  const Tracking tracking = track(plain_human(), input);
  EXPECT_THAT(tracking.findings, Contains(testing::AllOf(Field(&Finding::code, "scan-unit"),
                                                         Field(&Finding::place, "frames 1"))));
  EXPECT_EQ(tracking.tracked.scan_share[1], 0);
  EXPECT_LT(error_of(tracking, 1, 1 / 30.0), 0.015);
}

TEST(Track, ScansWithoutLabels_AreClothingAroundTheBody) {
  TrackInput input = walk(3, 0.012, 12);
  for (std::size_t f = 0; f < 3; ++f) {
    input.frames[f].scan = body_scan(f / 12.0);
    input.frames[f].scan.parts.assign(input.frames[f].scan.parts.size(), ScanPart::Cloth);
  }
  const Tracking tracking = track(plain_human(), input);
  EXPECT_THAT(tracking.findings, Contains(Field(&Finding::code, "labels-absent")));
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(tracking.tracked.trusted[f], 1);
    EXPECT_LT(error_of(tracking, f, f / 12.0), 0.015);
  }
}

// An unlabelled scan is all clothing: it says that the body is inside, no nearer than 10 cm.
TEST(Track, UnlabelledScan_ConfirmsAFrameWithoutKeypoints) {
  const auto followed = [](const Eigen::VectorXd& shown) {
    TrackInput input = walk(5, 0.004, 12);
    for (std::size_t f = 0; f < 5; ++f) {
      input.frames[f].scan = f == 2 ? scan_of(shown) : body_scan(static_cast<double>(f) / 12);
      input.frames[f].scan.parts.assign(input.frames[f].scan.parts.size(), ScanPart::Cloth);
    }
    input.frames[2].keypoints.resize(0, 3);
    input.frames[2].deviations.resize(0);
    return track(plain_human(), input);
  };
  const Eigen::VectorXd walks = walking(fitted_human(), 2 / 12.0);
  const Tracking right = followed(walks);
  EXPECT_THAT(right.findings, Contains(Field(&Finding::code, "labels-absent")));
  EXPECT_EQ(right.tracked.trusted, (std::vector<char>{1, 1, 1, 1, 1}));
  EXPECT_LT(error_of(right, 2, 2 / 12.0), 0.02);
  const Tracking wrong =
      followed(turned(turned(walks, "left_shoulder", 2.4), "right_shoulder", -2.4));
  EXPECT_EQ(wrong.tracked.trusted, (std::vector<char>{1, 1, 0, 1, 1}));
  EXPECT_GT(wrong.tracked.deviations.row(2).minCoeff(), 0.1);
}

TEST(ScanMatch, Vertices_MatchTheScanButNotAcrossItsHoles) {
  const Eigen::VectorXd x = walking(fitted_human(), 0);
  const BodySurface rest = rest_surface(fitted_human());
  const BodySurface surface = posed_surface(fitted_human(), rest, x);
  const Eigen::VectorXd areas = vertex_areas(rest.vertices, plain_human().mesh.faces);
  ScanPoints scan = body_scan(0);
  scan.points += 0.004 * scan.normals;
  const auto all = match_model(surface, areas, scan, scan_lookup(scan), {.count = 800});
  double share = 0;
  for (const SurfaceMatch& match : all) {
    share += match.weight;
    const Eigen::Vector3d at = surface.vertices.row(match.vertices[0]).transpose();
    EXPECT_NEAR(match.normal.dot(match.target - at), 0.004, 0.003);
  }
  EXPECT_GT(share, 0.8);
  EXPECT_LT(share, 1.1);
  // The left half was not seen; the right hand is clothed.
  ScanPoints half;
  std::vector<Index> kept;
  for (Index i = 0; i < scan.points.rows(); ++i) {
    if (rest.vertices(i, 0) < 0) {
      kept.push_back(i);
    }
  }
  half.points = scan.points(kept, Eigen::all);
  half.normals = scan.normals(kept, Eigen::all);
  half.areas = scan.areas(kept);
  for (const Index i : kept) {
    half.parts.push_back(rest.vertices(i, 0) < -0.5 ? ScanPart::Cloth : ScanPart::Skin);
  }
  const auto right = match_model(surface, areas, half, scan_lookup(half), {});
  EXPECT_GT(right.size(), 3000u);
  for (const SurfaceMatch& match : right) {
    EXPECT_LT(rest.vertices(match.vertices[0], 0), 0.07);
    EXPECT_GT(rest.vertices(match.vertices[0], 0), -0.56);
  }
  EXPECT_TRUE(match_model(surface, areas, {}, scan_lookup({}), {.count = 100}).empty());
  EXPECT_THROW(match_model(surface, areas.head(3), scan, scan_lookup(scan), {}), LogicError);
}

TEST(Track, HalfAScanAndASecondPerson_AreHarmless) {
  TrackInput input = walk(3, 0.004, 12);
  ScanPoints& scan = input.frames[1].scan;
  const ScanPoints whole = body_scan(1 / 12.0);
  const double middle = whole.points.col(1).mean();
  std::vector<Index> upper;
  for (Index i = 0; i < whole.points.rows(); ++i) {
    if (whole.points(i, 1) > middle) {
      upper.push_back(i);
    }
  }
  const auto half = static_cast<Index>(upper.size());
  scan.points.resize(2 * half, 3);
  scan.normals.resize(2 * half, 3);
  scan.areas.resize(2 * half);
  scan.parts.assign(static_cast<std::size_t>(2 * half), ScanPart::Skin);
  for (Index i = 0; i < half; ++i) {
    const Index from = upper[static_cast<std::size_t>(i)];
    for (const Index to : {i, half + i}) {  // and someone else half a metre beside
      scan.points.row(to) = whole.points.row(from);
      scan.normals.row(to) = whole.normals.row(from);
      scan.areas[to] = whole.areas[from];
    }
    scan.points(half + i, 0) += 1.2;
  }
  const Tracking tracking = track(plain_human(), input);
  EXPECT_LT(error_of(tracking, 1, 1 / 12.0), 0.012);
  EXPECT_THAT(tracking.findings, Contains(Field(&Finding::code, "scan-far")));
}

TEST(Track, SwingingClothing_IsFoundAndExcluded) {
  // A cone round the legs that swings from side to side, and skin above.
  TrackInput input = walk(6, 0.006, 12);
  for (std::size_t f = 0; f < 6; ++f) {
    ScanPoints scan = body_scan(f / 12.0);
    const double hip =
        fitted_human().shaped.joints(find_joint(plain_human().skeleton, "left_hip"), 1);
    for (Index i = 0; i < scan.points.rows(); ++i) {
      const double below = hip - scan.points(i, 1);
      if (below > 0) {
        scan.parts[static_cast<std::size_t>(i)] = ScanPart::Cloth;
        scan.points.row(i) += (0.02 + 0.2 * below * (f % 2 == 0 ? 1 : 0.3)) * scan.normals.row(i);
      }
    }
    input.frames[f].scan = scan;
  }
  const auto mean_error = [&](Exclude exclude) {
    TrackOptions options;
    options.exclude = exclude;
    options.samples = 1000;
    const Tracking tracking = track(plain_human(), input, options);
    double sum = 0;
    for (std::size_t f = 0; f < 6; ++f) {
      sum += error_of(tracking, f, f / 12.0) / 6;
    }
    return std::pair(sum, tracking.tracked.region);
  };
  const auto [with, region] = mean_error(Exclude::Auto);
  const auto [without, none] = mean_error(Exclude::None);
  EXPECT_TRUE(none.empty());
  EXPECT_LT(with, without);
  const Points& rest = fitted_human().shaped.vertices;
  ASSERT_GT(region.size(), 500u);
  for (const int v : region) {
    EXPECT_LT(rest(v, 1), 0.95);
  }
}

TEST(Track, WrongCalls_AreRefused) {
  TrackInput input = walk(3, 0);
  TrackOptions options;
  options.overlap = 9;
  EXPECT_THROW(track(plain_human(), input, options), LogicError);
  EXPECT_THROW(track(plain_human(), {}), LogicError);
  input.frame_ids = {0, 0, 1};
  EXPECT_THROW(track(plain_human(), input), LogicError);
  input = walk(3, 0);
  input.region = {1, 0};
  EXPECT_THROW(track(plain_human(), input), LogicError);
  input = walk(3, 0);
  input.frames[1].deviations.resize(4);
  EXPECT_THROW(track(plain_human(), input), LogicError);
  BodyModel box;
  box.skeleton = {{"root"}, {-1}, Points::Zero(1, 3), {}, {}, {}};
  box.mesh = plain_human().mesh;
  EXPECT_THROW(fitted_person(box, {}), DataError);
  EXPECT_THROW(scan_points(plain_human().mesh, {ScanPart::Skin}), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures
