// A person measured from bare scans and keypoints.
#include "bodymodel/tracking/personalize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/bone_lengths.h"
#include "bodymodel/measure.h"
#include "bodymodel/tracking/solve_shape.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/tree.h"
#include "tests/bodymodel_tracking/posed_person.h"
#include "tests/support/finite_differences.h"

namespace atelier::fixtures {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

const BodyModel& shaped_human() {
  static const BodyModel model = default_human();
  return model;
}

/// Somebody else: another shape, and a surface off the shape space.
const BodyModel& somebody() {
  static const BodyModel person = [] {
    Eigen::VectorXd shape = neutral_shape(shaped_human());
    for (std::size_t s = 0; s < shaped_human().shape.size(); ++s) {
      const ShapeParameter& parameter = shaped_human().shape[s];
      shape[static_cast<Index>(s)] +=
          (s % 2 == 0 ? 0.2 : -0.15) * (parameter.max - parameter.min) / 2;
    }
    BodyModel model = plain_person(shaped_human(), shape).model;
    const Points normals = vertex_normals(model.mesh.vertices, model.mesh.faces);
    for (Index v = 0; v < vertex_count(model); ++v) {
      const Eigen::RowVector3d x = model.mesh.vertices.row(v);
      model.mesh.vertices.row(v) +=
          0.006 * std::sin(20 * x.y()) * std::cos(9 * x.x()) * normals.row(v);
    }
    return model;
  }();
  return person;
}

TrackInput bare_frames(int frames, double noise, const BodyModel& who = somebody()) {
  const FittedPerson person = fitted_person(who, body_25_names());
  Random random{8};
  TrackInput input;
  input.keypoint_names = body_25_names();
  input.fps = 1;
  for (int f = 0; f < frames; ++f) {
    const Eigen::VectorXd x = walking(person, 0.7 * f);
    const FrameTargets seen = keypoints_of(person, x, noise, random);
    Mesh scan;
    scan.vertices = skin_vertices(who, pose_of_variables(person, x));
    scan.faces = who.mesh.faces;
    const std::vector<ScanPart> parts(static_cast<std::size_t>(scan.vertices.rows()),
                                      ScanPart::Skin);
    input.frame_ids.push_back(f);
    input.frames.push_back({seen.keypoints, seen.deviations, scan_points(scan, parts)});
  }
  return input;
}

/// Mean distance, metres, between the rest surfaces of two persons, area-weighted.
double surface_error(const BodyModel& found, const BodyModel& truth) {
  const TriangleTree tree = build_tree(truth.mesh.vertices, truth.mesh.faces);
  const Eigen::VectorXd areas = vertex_areas(found.mesh.vertices, found.mesh.faces);
  double sum = 0;
  const auto nearest = closest_points(tree, found.mesh.vertices);
  for (Index v = 0; v < areas.size(); ++v) {
    sum += areas[v] * std::sqrt(nearest[static_cast<std::size_t>(v)].squared_distance);
  }
  return sum / areas.sum();
}

PersonalizeOptions quick() {
  PersonalizeOptions options;
  options.samples = 1000;
  options.shape_rounds = 2;
  options.surface_rounds = 2;
  return options;
}

TEST(Personalize, ShapeDerivatives_MatchFiniteDifferences) {
  const FittedPerson start = fitted_person(shaped_human(), body_25_names());
  Eigen::VectorXd shape = neutral_shape(shaped_human());
  for (Index s = 0; s < shape.size(); ++s) {
    const ShapeParameter& parameter = shaped_human().shape[static_cast<std::size_t>(s)];
    shape[s] += 0.1 * (parameter.max - parameter.min);
  }
  const FittedPerson person = with_shape(start, shape);
  Random random{2};
  const Eigen::VectorXd x = walking(person, 0.3);
  FrameTargets targets = keypoints_of(person, x, 0.02, random);
  const Points vertices =
      skin_vertices(shaped_human(), person.shaped, pose_of_variables(person, x));
  for (int f = 0; f < shaped_human().mesh.faces.rows(); f += 1201) {
    SurfaceMatch match;
    match.barycentric = {0.2, 0.3, 0.5};
    for (int c = 0; c < 3; ++c) {
      match.vertices[static_cast<std::size_t>(c)] = shaped_human().mesh.faces(f, c);
      match.target +=
          match.barycentric[c] * vertices.row(shaped_human().mesh.faces(f, c)).transpose();
    }
    match.normal = Eigen::Vector3d(0.3, 0.5, -0.2).normalized();
    match.target += 0.01 * match.normal;
    match.weight = 0.05;
    targets.matches.push_back(match);
  }
  const FrameWeights weights;
  const Eigen::VectorXd analytic =
      frame_shape_energy(person, targets, x, weights).gradient.tail(shape.size());
  for (Index s = 0; s < shape.size(); ++s) {
    const ShapeParameter& parameter = shaped_human().shape[static_cast<std::size_t>(s)];
    const double step = 1e-5 * (parameter.max - parameter.min);
    const auto cost = [&](double by) {
      Eigen::VectorXd moved = shape;
      moved[s] += by;
      return frame_energy(with_shape(person, moved), targets, x, weights, false).cost;
    };
    const double numeric = (cost(step) - cost(-step)) / (2 * step);
    EXPECT_NEAR(analytic[s], numeric, 1e-5 * std::max(1.0, std::abs(numeric))) << parameter.name;
  }
}

TEST(Personalize, ThreeFrames_RecoverAnotherPerson) {
  const TrackInput input = bare_frames(3, 0.005);
  PersonalizeOptions options;
  options.samples = 1500;
  options.shape_rounds = 4;
  options.surface_rounds = 3;
  const Personalization found = personalize(shaped_human(), input, options);
  const double before = surface_error(plain_person(shaped_human()).model, somebody());
  const double after = surface_error(found.person.model, somebody());
  std::printf("surface %.2f mm before, %.2f mm after; scans %.2f mm, keypoints %.1f mm\n",
              1e3 * before, 1e3 * after, 1e3 * found.scan_rms, 1e3 * found.keypoint_rms);
  EXPECT_GT(before, 0.006);
  EXPECT_LT(after, 0.003);
  EXPECT_LT(found.scan_rms, 0.003);
  EXPECT_LT(found.unseen, 0.2);
}

TEST(Personalize, BonesOutsideTheShapeSpace_AreRecovered) {
  // One whose forearms are longer and shins shorter than any shape of the model says.
  const BodyModel bones = with_bone_lengths(shaped_human());
  Eigen::VectorXd shape = neutral_shape(bones);
  shape[find_shape(bones, "forearm_length")] = 0.02;
  shape[find_shape(bones, "shin_length")] = -0.02;
  const BodyModel person = plain_person(bones, shape).model;
  PersonalizeOptions options;
  options.samples = 1000;
  options.shape_rounds = 3;
  options.surface_rounds = 1;
  options.bone_lengths = 0.06;
  const TrackInput input = bare_frames(4, 0.003, person);
  const auto joints_off = [&] {
    const BodyModel found = personalize(shaped_human(), input, options).person.model;
    double sum = 0;
    for (const char* name : {"left_wrist", "right_elbow", "left_ankle", "right_knee"}) {
      const int joint = find_joint(person.skeleton, name);
      sum += std::abs(found.skeleton.offsets.row(joint).norm() -
                      person.skeleton.offsets.row(joint).norm());
    }
    return sum / 4;
  };
  const double with = joints_off();
  options.bone_lengths = 0;
  const double without = joints_off();
  std::printf("bones %.1f mm off, %.1f mm without their lengths\n", 1e3 * with, 1e3 * without);
  EXPECT_LT(with, 0.004);
  EXPECT_LT(with, 0.7 * without);
}

TEST(Personalize, KeypointsAlone_GiveBoneLengths) {
  TrackInput input = bare_frames(4, 0.003);
  for (TrackFrame& frame : input.frames) {
    frame.scan = {};
  }
  const Personalization found = personalize(shaped_human(), input);
  EXPECT_THAT(found.findings, Contains(Field(&Finding::code, "no-scans")));
  const auto leg = [](const BodyModel& model) {
    return model.skeleton.offsets.row(find_joint(model.skeleton, "left_knee")).norm() +
           model.skeleton.offsets.row(find_joint(model.skeleton, "left_ankle")).norm();
  };
  EXPECT_NEAR(leg(found.person.model), leg(somebody()), 0.01);
}

// A detector is off where joints truly are by centimetres, and in every frame alike.
TEST(Personalize, BiasedKeypointsAlone_KeepAPlausibleShape) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    TrackInput input = bare_frames(4, 0.003);
    Random random{seed};
    const Points bias = 0.03 * Points::NullaryExpr(input.frames[0].keypoints.rows(), 3,
                                                   [&] { return normal(random); });
    for (TrackFrame& frame : input.frames) {
      frame.scan = {};
      frame.keypoints += bias;
    }
    const PersonalBody found = personalize(shaped_human(), input).person;
    for (std::size_t s = 0; s < shaped_human().shape.size(); ++s) {
      const ShapeParameter& parameter = shaped_human().shape[s];
      EXPECT_GE(found.shape[static_cast<Index>(s)], parameter.min) << parameter.name << seed;
      EXPECT_LE(found.shape[static_cast<Index>(s)], parameter.max) << parameter.name << seed;
    }
  }
}

// Heels, which mass moves by a millimetre or two, are off in all frames alike: they make nobody
// thin.
TEST(Personalize, KeypointsAlone_RecoverLengthsAndKeepPriorGirths) {
  DefaultHumanOptions options;
  options.male = 1;
  options.stature = 1.82;
  options.shape_basis = false;
  const BodyModel somebody_tall = default_human(options);
  TrackInput input = bare_frames(6, 0.003, somebody_tall);
  const auto keypoint = [](const char* name) {
    const std::vector<std::string>& names = body_25_names();
    return std::find(names.begin(), names.end(), name) - names.begin();
  };
  for (TrackFrame& frame : input.frames) {
    frame.scan = {};
    for (const auto& [heel, toe] :
         {std::pair("left_heel", "left_big_toe"), {"right_heel", "right_big_toe"}}) {
      const Eigen::RowVector3d foot =
          frame.keypoints.row(keypoint(heel)) - frame.keypoints.row(keypoint(toe));
      frame.keypoints.row(keypoint(heel)) -= 0.03 * foot.normalized();
    }
  }
  const Personalization found = personalize(shaped_human(), input);
  EXPECT_THAT(found.findings, Not(Contains(Field(&Finding::code, "measure-implausible"))));
  const BodyMeasurements real = measure_body(somebody_tall);
  const BodyMeasurements ours = measure_body(found.person.model);
  for (const NamedMeasurement& one : measurement_names()) {
    const bool length = one.name == "stature" || one.name.ends_with("_length");
    EXPECT_NEAR(ours.*one.value / (real.*one.value), 1, length ? 0.03 : 0.12) << one.name;
  }
}

// Scans are believed, and what nobody has is said.
TEST(Personalize, ImplausibleLimbs_AreReported) {
  Eigen::VectorXd shape = neutral_shape(shaped_human());
  shape[find_shape(shaped_human(), "mass")] -= 16;
  const Personalization thin = personalize(
      shaped_human(), bare_frames(3, 0.003, plain_person(shaped_human(), shape).model), quick());
  EXPECT_THAT(thin.findings,
              Contains(testing::AllOf(Field(&Finding::code, "measure-implausible"),
                                      Field(&Finding::what, HasSubstr("calf_girth of 0.1")))));
  const Personalization usual = personalize(shaped_human(), bare_frames(3, 0.003), quick());
  EXPECT_THAT(usual.findings, Not(Contains(Field(&Finding::code, "measure-implausible"))));
}

TEST(Personalize, UnseenSurface_IsReported) {
  TrackInput input = bare_frames(2, 0.003);
  for (TrackFrame& frame : input.frames) {
    for (Index i = 0; i < frame.scan.points.rows(); ++i) {
      if (frame.scan.points(i, 1) < 0.5) {
        frame.scan.parts[static_cast<std::size_t>(i)] = ScanPart::Ignored;
      }
    }
  }
  PersonalizeOptions options;
  options.samples = 800;
  options.shape_rounds = 1;
  options.surface_rounds = 1;
  const Personalization found = personalize(shaped_human(), input, options);
  EXPECT_THAT(found.findings, Contains(Field(&Finding::code, "frames-few")));
  EXPECT_THAT(found.findings, Contains(Field(&Finding::code, "surface-unseen")));
  EXPECT_GT(found.unseen, 0.1);
}

TEST(Personalize, ScansInMillimetres_AreLeftOut) {
  TrackInput input = bare_frames(3, 0.003);
  input.frames[1].scan.points *= 1000;
  input.frames[1].scan.areas *= 1e6;
  const Personalization found = personalize(shaped_human(), input, quick());
  EXPECT_THAT(found.findings, Contains(testing::AllOf(Field(&Finding::code, "scan-unit"),
                                                      Field(&Finding::place, "frames 1"))));
  EXPECT_LT(surface_error(found.person.model, somebody()), 0.004);
  for (const std::size_t f : {0, 2}) {
    input.frames[f].scan.points *= 1000;
  }
  const Personalization none = personalize(shaped_human(), input, quick());
  EXPECT_THAT(none.findings, Contains(Field(&Finding::code, "no-scans")));
}

TEST(Personalize, ScansOfAnotherPlace_AreLeftOut) {
  TrackInput input = bare_frames(3, 0.003);
  input.frames[1].scan.points.col(0).array() += 3;
  const Personalization found = personalize(shaped_human(), input, quick());
  EXPECT_THAT(found.findings, Contains(testing::AllOf(Field(&Finding::code, "scan-far"),
                                                      Field(&Finding::place, "frames 1"))));
  EXPECT_LT(surface_error(found.person.model, somebody()), 0.004);
  for (const std::size_t f : {0, 2}) {
    input.frames[f].scan.points.col(0).array() += 3;
  }
  const Personalization none = personalize(shaped_human(), input, quick());
  EXPECT_THAT(none.findings, Contains(Field(&Finding::code, "no-scans")));
  EXPECT_EQ(none.scan_rms, 0);
}

TEST(Personalize, ClothingAlone_MovesNoSurface) {
  TrackInput input = bare_frames(3, 0.003);
  for (TrackFrame& frame : input.frames) {  // as scans of a clothed sequence without labels
    std::fill(frame.scan.parts.begin(), frame.scan.parts.end(), ScanPart::Cloth);
  }
  const Personalization found = personalize(shaped_human(), input, quick());
  EXPECT_THAT(found.findings, Contains(Field(&Finding::code, "surface-unseen")));
  EXPECT_GT(found.unseen, 0.99);
  EXPECT_LT(found.person.displacements.rowwise().norm().maxCoeff(), 1e-9);
}

TEST(Personalize, UnseenHalf_FollowsTheSeenHalf) {
  TrackInput input = bare_frames(3, 0.003);
  for (TrackFrame& frame : input.frames) {
    ASSERT_EQ(frame.scan.points.rows(), vertex_count(somebody()));
    for (Index i = 0; i < frame.scan.points.rows(); ++i) {
      if (somebody().mesh.vertices(i, 0) < 0) {
        frame.scan.parts[static_cast<std::size_t>(i)] = ScanPart::Ignored;
      }
    }
  }
  const Personalization found = personalize(shaped_human(), input, quick());
  EXPECT_THAT(found.findings, Contains(Field(&Finding::code, "surface-unseen")));
  EXPECT_NEAR(found.unseen, 0.4, 0.2);
  EXPECT_LT(surface_error(found.person.model, somebody()), 0.006);
}

TEST(Personalize, SecondPersonInTheScan_IsIgnored) {
  TrackInput input = bare_frames(3, 0.003);
  for (TrackFrame& frame : input.frames) {
    ScanPoints both = frame.scan;
    const Index count = both.points.rows();
    both.points.resize(2 * count, 3);
    both.points << frame.scan.points, frame.scan.points.rowwise() + Eigen::RowVector3d(1, 0, 0);
    both.normals.resize(2 * count, 3);
    both.normals << frame.scan.normals, frame.scan.normals;
    both.areas.resize(2 * count);
    both.areas << frame.scan.areas, frame.scan.areas;
    both.parts.insert(both.parts.end(), frame.scan.parts.begin(), frame.scan.parts.end());
    frame.scan = both;
  }
  const Personalization found = personalize(shaped_human(), input, quick());
  EXPECT_LT(surface_error(found.person.model, somebody()), 0.004);
}

TEST(Personalize, InputWithoutAPerson_IsRefused) {
  TrackInput input = bare_frames(1, 0);
  input.frames[0].deviations.setZero();
  try {
    personalize(shaped_human(), input);
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no frame that shows a person"));
  }
  EXPECT_THROW(personalize(shaped_human(), {}), LogicError);
  input.frames[0].deviations.resize(2);
  EXPECT_THROW(personalize(shaped_human(), input), LogicError);
  const FittedPerson plain = fitted_person(plain_human(), body_25_names());
  EXPECT_THROW(solve_shape(plain, {}, {}, {}, 1), LogicError);
  const FittedPerson shaped =
      with_shape(fitted_person(shaped_human(), body_25_names()), neutral_shape(shaped_human()));
  FrameTargets targets;
  targets.keypoints = input.frames[0].keypoints;
  targets.deviations = Eigen::VectorXd::Zero(targets.keypoints.rows());
  EXPECT_THROW(
      solve_shape(shaped, {&targets}, {walking(shaped, 0)}, {}, 1, Eigen::MatrixXd::Identity(2, 2)),
      LogicError);
  EXPECT_THROW(frame_shape_energy(fitted_person(shaped_human(), {}), {}, walking(plain, 0), {}),
               LogicError);
}

TEST(Personalize, EveryVertex_HasAMirrorImage) {
  const std::vector<int> mirror = mirror_vertices(plain_human().mesh.vertices);
  for (std::size_t v = 0; v < mirror.size(); ++v) {
    ASSERT_GE(mirror[v], 0);
    EXPECT_EQ(mirror[static_cast<std::size_t>(mirror[v])], static_cast<int>(v));
  }
}

}  // namespace
}  // namespace atelier::fixtures
