#include "bodymodel/formats/motion_file.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/unknown_value.h"
#include "tests/bodymodel/smpl_arrays.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using fixtures::person_clip;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

MotionClip in_centimetres() {
  MotionClip clip = person_clip();
  clip.skeleton.offsets *= 100;
  for (Pose& pose : clip.motion.poses) {
    pose.root_translation *= 100;
  }
  return clip;
}

double legs(const MotionClip& clip) {
  return leg_length(clip.skeleton, recognised_humanoid(clip.skeleton));
}

TEST(MotionFile, EveryWrittenFormat_ReadsBackEqual) {
  const fixtures::TemporaryDirectory folder;
  MotionClip clip = person_clip();
  clip.motion.fps = 50;
  for (const char* name : {"a.bvh", "a.npz", "a.glb", "a.gltf"}) {
    SCOPED_TRACE(name);
    write_motion_file(folder / name, clip);
    const MotionClip back = read_motion_file(folder / name);
    ASSERT_EQ(back.motion.poses.size(), clip.motion.poses.size());
    EXPECT_EQ(back.motion.fps, clip.motion.fps);
    const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[4]).positions;
    const Points is = forward_kinematics(back.skeleton, back.motion.poses[4]).positions;
    EXPECT_LT((is - was).cwiseAbs().maxCoeff(), 1e-4);
  }
  EXPECT_THROW(write_motion_file(folder / "a.fbx", clip), LogicError);
}

TEST(MotionFile, CentimetresInMetreFormats_AreRepairedAndReported) {
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"cm.npz", "cm.glb"}) {
    SCOPED_TRACE(name);
    write_motion_file(folder / name, in_centimetres());
    const MotionClip back = read_motion_file(folder / name);
    EXPECT_NEAR(legs(back), 0.83, 0.01);
    ASSERT_FALSE(back.findings.empty());
    EXPECT_EQ(back.findings.back().code, "motion-unit");
    EXPECT_THAT(back.findings.back().what, HasSubstr("one unit taken as 0.01 m"));
  }
}

TEST(MotionFile, GivenUnitAndRate_ApplyToNpz) {
  const fixtures::TemporaryDirectory folder;
  write_motion_file(folder / "m.npz", person_clip());
  EXPECT_TRUE(read_motion_file(folder / "m.npz").findings.empty());
  MotionFileOptions options;
  options.motion.metres_per_unit = 0.5;
  options.motion.fps = 24;
  const MotionClip child = read_motion_file(folder / "m.npz", options);
  EXPECT_NEAR(legs(child), 0.415, 0.01);
  EXPECT_EQ(child.motion.fps, 24);
}

TEST(MotionFile, AnimationThatAFormatOfOneMotionCannotHave_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  for (const char* name : {"a.bvh", "a.npz", "a.glb"}) {
    write_motion_file(folder / name, person_clip());
    MotionFileOptions options;
    for (const char* wanted : {"Walk", "2", "0"}) {
      options.motion.animation = wanted;
      EXPECT_THAT(
          [&] { read_motion_file(folder / name, options); },
          ThrowsMessage<UnknownValue>(HasSubstr(std::string("animation: '") + wanted + "'")))
          << name;
    }
    options.motion.animation = "1";
    EXPECT_EQ(read_motion_file(folder / name, options).motion.poses.size(),
              person_clip().motion.poses.size());
  }
}

TEST(MotionFile, PeopleBeyondAStage_AreRefused) {
  const fixtures::TemporaryDirectory folder;
  MotionClip clip = person_clip();
  clip.motion.poses[2].root_translation.x() = 1e6;
  for (const char* name : {"far.npz", "far.glb", "far.bvh"}) {
    SCOPED_TRACE(name);
    write_motion_file(folder / name, clip);
    EXPECT_THAT([&] { read_motion_file(folder / name); },
                ThrowsMessage<DataError>(HasSubstr("m from the origin")));
  }
}

TEST(MotionFile, OtherExtensions_AreRefused) {
  EXPECT_THAT([] { read_motion_file("walk.usd"); },
              ThrowsMessage<DataError>(HasSubstr("extension '.usd'")));
}

}  // namespace
}  // namespace atelier

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Tensor word_array(const std::string& word) {
  return Tensor{ElementType::Text, {}, {}, {word}};
}

struct OtherPerson {
  const char* name;
  std::int64_t body_joints;
  std::int64_t columns;
  const char* body_gender;
  const char* gender;
  const char* surface;
  bool same;
};

class AmassFamily : public ::testing::TestWithParam<OtherPerson> {};

// Shapes of SMPL-X are no shapes of SMPL or SMPL-H, which share theirs, and those of a woman's body
// are none of a man's.
TEST_P(AmassFamily, BetasOfAnotherBody_AreLeftOutAndSaid) {
  const OtherPerson& other = GetParam();
  BodyModel model = t_posed(other.body_joints, 20);
  model.name += other.body_gender;
  Arrays arrays = amass_arrays(other.columns);
  arrays["gender"] = word_array(other.gender);
  if (*other.surface != 0) {
    arrays["surface_model_type"] = word_array(other.surface);
  }
  const MotionClip clip = read_amass_arrays(arrays, &model);
  const Points neutral = shaped_skeleton(model, neutral_shape(model)).offsets;
  EXPECT_EQ(clip.skeleton.offsets == neutral, !other.same);
  const Finding* finding = finding_of(clip, "motion-shape");
  ASSERT_EQ(finding == nullptr, other.same);
  if (finding != nullptr) {
    EXPECT_EQ(finding->severity, Severity::Warning);
    EXPECT_THAT(finding->what, HasSubstr("its betas are shapes of "));
  }
  arrays["betas"] = zeros({16});  // the mean is the mean
  EXPECT_EQ(finding_of(read_amass_arrays(arrays, &model), "motion-shape"), nullptr);
}

INSTANTIATE_TEST_SUITE_P(
    Bodies, AmassFamily,
    ::testing::Values(OtherPerson{"HOnX", 55, 156, "", "female", "", false},
                      OtherPerson{"XOnH", 52, 165, "", "female", "smplx", false},
                      OtherPerson{"XOnSmpl", 24, 165, "", "male", "", false},
                      OtherPerson{"SmplOnX", 55, 72, "", "male", "", false},
                      OtherPerson{"FacelessXOnH", 52, 156, "", "male", "smplx", false},
                      OtherPerson{"FacelessXOnX", 55, 156, "", "male", "SMPL-X", true},
                      OtherPerson{"HOnSmpl", 24, 156, "", "male", "smplh", true},
                      OtherPerson{"SmplOnH", 52, 72, "", "male", "smpl", true},
                      OtherPerson{"XOnX", 55, 165, "_neutral", "neutral", "smplx", true},
                      OtherPerson{"WomanOnMan", 55, 165, "_male", "female", "smplx", false},
                      OtherPerson{"ManOnNeutral", 52, 156, "_neutral", "male", "smplh", false},
                      OtherPerson{"UnsaidOnMan", 52, 156, "_male", "unknown", "", true}),
    [](const auto& other) { return std::string(other.param.name); });

TEST(Amass, PosesOfAnotherModelThanIsSaid_AreRefused) {
  for (const auto& [surface, columns] :
       {std::pair("smplx", 72), {"smplh", 165}, {"smplh", 72}, {"smpl", 165}}) {
    Arrays arrays = amass_arrays(columns);
    arrays["surface_model_type"] = word_array(surface);
    EXPECT_THAT([&] { read_amass_arrays(arrays); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(std::to_string(columns) + " columns"),
                                               HasSubstr(std::string("is ") + surface))));
  }
}

TEST(Amass, BetasOfEveryFrame_AreOfOnePerson) {
  const BodyModel model = t_posed(55, 20);
  Arrays arrays = amass_arrays(165);
  const RowMatrix betas = RowMatrix::Random(1, 10);
  arrays["betas"] = tensor_of_rows(betas);
  const Points one = read_amass_arrays(arrays, &model).skeleton.offsets;
  EXPECT_EQ(one, shaped_skeleton(model, betas.transpose()).offsets);
  RowMatrix rows = betas.replicate(4, 1);
  arrays["betas"] = tensor_of_rows(rows);
  const MotionClip same = read_amass_arrays(arrays, &model);
  EXPECT_LT((same.skeleton.offsets - one).norm(), 1e-12);
  EXPECT_TRUE(same.findings.empty());
  rows(1, 0) += 0.2;
  rows(2, 0) -= 0.2;
  arrays["betas"] = tensor_of_rows(rows);
  const MotionClip changing = read_amass_arrays(arrays, &model);
  EXPECT_LT((changing.skeleton.offsets - one).norm(), 1e-12);
  ASSERT_NE(finding_of(changing, "motion-shape"), nullptr);
  EXPECT_THAT(finding_of(changing, "motion-shape")->what, HasSubstr("change from frame to frame"));
}

TEST(Amass, ShapeOfAPersonOfOneGender_NamesTheBodyThatItIsOf) {
  const BodyModel model = t_posed(55, 20);
  Arrays arrays = amass_arrays(165);
  arrays["gender"] = word_array("female");
  const Eigen::VectorXd shape = neutral_shape(model);
  const MotionClip clip = read_amass(Npz(npz_bytes(arrays), "walk.npz"), &model, shape);
  ASSERT_NE(finding_of(clip, "motion-shape"), nullptr);
  EXPECT_THAT(finding_of(clip, "motion-shape")->advice,
              HasSubstr("makes that person on the female body of SMPL-X"));
}

/// What a person does, 2 s at 60 frames a second, Y up and in metres.
enum class Doing { Walks, Sways, Skates, Treadmill, Stands };

/// Legs that swing or stand, and a path of which the foot that stands does not slide.
Arrays person_doing(Doing what) {
  constexpr Index kFrames = 120;
  RowMatrix poses = RowMatrix::Zero(kFrames, 156);
  const double swing = what == Doing::Walks || what == Doing::Treadmill ? 0.4
                       : what == Doing::Skates                          ? 0.1
                                                                        : 0.02;
  const bool moves = what != Doing::Stands;
  for (Index f = 0; f < kFrames && moves; ++f) {
    const double phase = 2 * std::numbers::pi * static_cast<double>(f) / 60;
    const double knee = swing * std::max(0.0, std::sin(phase));
    poses.block<1, 2>(f, 3) << -swing * std::cos(phase), 0.01;  // hips
    poses.block<1, 2>(f, 6) << swing * std::cos(phase), -0.01;
    poses(f, 12) = knee;  // of the leg that swings forward
    poses(f, 15) = swing - knee;
  }
  Arrays arrays;
  arrays["poses"] = tensor_of_rows(poses);
  arrays["trans"] = zeros({kFrames, 3});
  arrays["mocap_framerate"] = tensor_of<double>(std::vector<double>{60}, {});
  RowMatrix trans = RowMatrix::Zero(kFrames, 3);
  trans.col(1).setConstant(0.93);
  const MotionClip still =
      read_amass(Npz(npz_bytes(arrays), "still.npz"), nullptr, {}, {.up = 'y'});
  const auto lowest = [&](Index f, const char* foot) {
    const Pose& pose = still.motion.poses[static_cast<std::size_t>(f)];
    return Eigen::RowVector3d(
        forward_kinematics(still.skeleton, pose).positions.row(find_joint(still.skeleton, foot)));
  };
  for (Index f = 1; f < kFrames; ++f) {
    if (what == Doing::Skates) {
      trans(f, 2) = 0.08 * static_cast<double>(f);
    } else if (what == Doing::Walks || what == Doing::Sways) {
      const bool left =
          what == Doing::Sways || lowest(f, "left_foot").y() < lowest(f, "right_foot").y();
      const char* foot = left ? "left_foot" : "right_foot";
      trans.row(f) = trans.row(f - 1) - (lowest(f, foot) - lowest(f - 1, foot));
    }
  }
  arrays["trans"] = tensor_of_rows(trans);
  return arrays;
}

TEST(Amass, PathInCentimetresOrMillimetres_IsToldByTheFeet) {
  for (const Doing what : {Doing::Walks, Doing::Sways, Doing::Stands}) {
    SCOPED_TRACE(static_cast<int>(what));
    Arrays arrays = person_doing(what);
    const RowMatrix trans = matrix_of(arrays.at("trans"));
    const auto read_with = [&](double units, const MotionOptions& options) {
      arrays["trans"] = tensor_of_rows(RowMatrix(units * trans));
      return read_amass(Npz(npz_bytes(arrays), "units.npz"), nullptr, {}, options);
    };
    const MotionClip metres = read_with(1, {.up = 'y'});
    EXPECT_EQ(finding_of(metres, "motion-unit"), nullptr);
    for (const double units : {100.0, 1000.0}) {
      for (const bool said : {false, true}) {
        const MotionClip clip =
            read_with(units, {.metres_per_unit = said ? 1 / units : 0, .up = 'y'});
        for (std::size_t frame = 0; frame < 120; frame += 17) {
          EXPECT_LT((clip.motion.poses[frame].root_translation -
                     metres.motion.poses[frame].root_translation)
                        .norm(),
                    1e-9);
        }
        EXPECT_EQ(clip.skeleton.offsets, metres.skeleton.offsets);
        EXPECT_EQ(finding_of(clip, "motion-unit") == nullptr, said);
      }
    }
    const MotionClip as_said = read_with(100, {.metres_per_unit = 1, .up = 'y'});
    EXPECT_NEAR(as_said.motion.poses[0].root_translation.y(), 93, 1e-9);
    EXPECT_EQ(finding_of(as_said, "motion-unit"), nullptr);
  }
}

TEST(Amass, PathInMetres_IsLeftWhateverThePersonDoes) {
  for (const Doing what : {Doing::Skates, Doing::Treadmill}) {
    const MotionClip clip =
        read_amass(Npz(npz_bytes(person_doing(what)), "metres.npz"), nullptr, {}, {.up = 'y'});
    EXPECT_EQ(finding_of(clip, "motion-unit"), nullptr) << static_cast<int>(what);
  }
}

// A pelvis that moves slowly about the origin in centimetres may be on wheels in metres.
TEST(Amass, PathThatFeetAloneDoubt_IsLeftAndSaid) {
  Arrays arrays = person_doing(Doing::Sways);
  RowMatrix trans = matrix_of(arrays.at("trans"));
  trans.rowwise() -= trans.row(0).eval();
  arrays["trans"] = tensor_of_rows(RowMatrix(100 * trans));
  const MotionClip clip = read_amass(Npz(npz_bytes(arrays), "sway.npz"), nullptr, {}, {.up = 'y'});
  ASSERT_NE(finding_of(clip, "motion-unit"), nullptr);
  EXPECT_THAT(finding_of(clip, "motion-unit")->what, HasSubstr("may be in centimetres"));
  EXPECT_THAT(finding_of(clip, "motion-unit")->advice, HasSubstr("metres-per-unit 0.01, or 1"));
  EXPECT_NEAR(clip.motion.poses[40].root_translation.z(), 100 * trans(40, 2), 1e-9);
}

}  // namespace
}  // namespace atelier::fixtures
