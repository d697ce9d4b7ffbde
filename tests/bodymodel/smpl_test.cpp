#include "bodymodel/formats/smpl.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/euler.h"
#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/motion_amass.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/rotation.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "core/random.h"
#include "tests/bodymodel/smpl_arrays.h"
#include "tests/support/places.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

BodyModel read(const Arrays& arrays, const SmplOptions& options = {}) {
  return read_smpl(Npz(npz_bytes(arrays), "body.npz"), options).model;
}

TEST(Smpl, JointCount_TellsTheFamily) {
  EXPECT_EQ(read(smpl_arrays(24, 10)).name, "smpl");
  EXPECT_EQ(read(smpl_arrays(52, 16)).name, "smplh");
  EXPECT_EQ(read(smpl_arrays(55, 20)).name, "smplx");
  EXPECT_EQ(read(smpl_arrays(24, 300, true)).name, "star");
}

TEST(Smpl, GenderInTheNameOfFileOrFolder_IsPartOfTheName) {
  const std::vector<std::byte> bytes = npz_bytes(smpl_arrays(24, 10));
  const auto named = [&](const char* file) { return read_smpl(Npz(bytes, file)).model.name; };
  EXPECT_EQ(named("bodies/SMPL_FEMALE.npz"), "smpl_female");
  EXPECT_EQ(named("male/model.npz"), "smpl_male");
  EXPECT_EQ(named("male/SMPL_NEUTRAL.npz"), "smpl_neutral");
  EXPECT_EQ(named("basicmodel_f_lbs_10_207_0_v1.1.0.npz"), "smpl_female");
  EXPECT_EQ(named("m/malevolent_f.npz"), "smpl");
}

TEST(Smpl, JointTrees_MatchThePublishedOnes) {
  const std::vector<int> smpl = smpl_parents(24);
  EXPECT_EQ(smpl, (std::vector<int>{-1, 0, 0, 0,  1,  2,  3,  4,  5,  6,  7,  8,
                                    9,  9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21}));
  const std::vector<std::string> x = smpl_joint_names(55);
  EXPECT_EQ(x[22], "jaw");
  EXPECT_EQ(x[25], "left_index1");
  EXPECT_EQ(x[54], "right_thumb3");
  for (const Index joints : {24, 52, 55}) {
    Skeleton skeleton;
    skeleton.names = smpl_joint_names(joints);
    skeleton.parents = smpl_parents(joints);
    skeleton.offsets = Points::Ones(joints, 3);
    EXPECT_NO_THROW(check_skeleton(skeleton));
    EXPECT_TRUE(find_humanoid(skeleton).has_value());
  }
}

// The published formula, written out: joints from the shaped template, correctives from R - I,
// world transforms down the tree, vertices blended.
Points published_vertices(const Arrays& a, Index joints, const Pose& pose,
                          const Eigen::VectorXd& betas) {
  const RowMatrix rest = matrix_of(a.at("v_template"));
  const std::vector<double> shapes = doubles_of(a.at("shapedirs"));
  const std::vector<double> poses = doubles_of(a.at("posedirs"));
  const RowMatrix regressor = matrix_of(a.at("J_regressor"));
  const RowMatrix weights = matrix_of(a.at("weights"));
  const std::int64_t shape_count = a.at("shapedirs").shape[2];
  const std::int64_t pose_count = a.at("posedirs").shape[2];
  RowMatrix shaped = rest;
  for (Index i = 0; i < shaped.size(); ++i) {
    for (Index s = 0; s < betas.size(); ++s) {
      shaped.data()[i] += betas[s] * shapes[static_cast<std::size_t>(i * shape_count + s)];
    }
  }
  const RowMatrix j = regressor * shaped;
  Eigen::VectorXd feature(9 * (joints - 1));
  for (Index k = 1; k < joints; ++k) {
    const Eigen::Matrix3d d = rotation_matrix(pose.rotations.row(k)) - Eigen::Matrix3d::Identity();
    for (int e = 0; e < 9; ++e) {
      feature[9 * (k - 1) + e] = d(e / 3, e % 3);
    }
  }
  for (Index i = 0; i < shaped.size(); ++i) {
    for (Index p = 0; p < pose_count; ++p) {
      shaped.data()[i] += feature[p] * poses[static_cast<std::size_t>(i * pose_count + p)];
    }
  }
  std::vector<Eigen::Matrix4d> world(static_cast<std::size_t>(joints));
  const std::vector<int> parents = smpl_parents(joints);
  for (Index k = 0; k < joints; ++k) {
    Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
    local.topLeftCorner<3, 3>() = rotation_matrix(pose.rotations.row(k));
    local.topRightCorner<3, 1>() = j.row(k);
    if (parents[k] >= 0) {
      local.topRightCorner<3, 1>() -= j.row(parents[k]);
      local = world[parents[k]] * local;
    }
    world[k] = local;
  }
  Points result(shaped.rows(), 3);
  for (Index v = 0; v < shaped.rows(); ++v) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Index k = 0; k < joints; ++k) {
      const Eigen::Vector3d local = shaped.row(v) - j.row(k);
      sum += weights(v, k) *
             (world[k].topLeftCorner<3, 3>() * local + world[k].topRightCorner<3, 1>());
    }
    result.row(v) = sum + pose.root_translation;
  }
  return result;
}

TEST(Smpl, Vertices_MatchThePublishedFormula) {
  for (const Index joints : {24, 52, 55}) {
    const Arrays arrays = smpl_arrays(joints, 20);
    const BodyModel model = read(arrays);
    Random random{9};
    Pose pose = rest_pose(model.skeleton);
    for (Index i = 0; i < pose.rotations.size(); ++i) {
      pose.rotations.data()[i] = 0.5 * normal(random);
    }
    pose.root_translation = {0.3, -0.2, 1};
    Eigen::VectorXd betas(10);
    for (Index i = 0; i < 10; ++i) {
      betas[i] = normal(random);
    }
    // 0.6f + 0.4f is a rounding error of float away from 1, which the reader takes out.
    EXPECT_LT((skin_vertices(model, pose, betas) - published_vertices(arrays, joints, pose, betas))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-6);
  }
}

TEST(Smpl, FlatPoseDirections_GiveTheSame) {
  Arrays arrays = smpl_arrays(24, 10);
  const BodyModel model = read(arrays);
  const std::vector<double> values = doubles_of(arrays["posedirs"]);
  std::vector<double> flat(values.size());
  for (std::size_t i = 0; i < 3 * kVertices; ++i) {
    for (std::size_t p = 0; p < 207; ++p) {
      flat[p * 3 * kVertices + i] = values[i * 207 + p];
    }
  }
  arrays["posedirs"] = tensor_of<double>(flat, {207, 3 * kVertices});
  const BodyModel other = read(arrays);
  EXPECT_EQ(other.correctives[100].surface.offsets, model.correctives[100].surface.offsets);
}

TEST(Smpl, StarLastFeature_IsAddedToTheSecondShape) {
  Arrays arrays = smpl_arrays(24, 10, true);
  const BodyModel model = read(arrays);
  EXPECT_EQ(model.correctives.size(), 92u);
  EXPECT_EQ(model.correctives[0].feature, PoseFeature::QuaternionEntry);
  const std::vector<double> shapes = doubles_of(arrays["shapedirs"]);
  const std::vector<double> poses = doubles_of(arrays["posedirs"]);
  EXPECT_NEAR(model.shape[1].surface.offsets(4, 2),
              shapes[(4 * 3 + 2) * 10 + 1] + poses[(4 * 3 + 2) * 93 + 92], 1e-12);
}

TEST(Smpl, Expressions_ComeAfterTheShapes) {
  SmplOptions options;
  options.betas = 4;
  options.expressions = 2;
  const BodyModel model = read(smpl_arrays(55, 20), options);
  ASSERT_EQ(model.shape.size(), 6u);
  EXPECT_EQ(model.shape[4].name, "expression_0");
  const std::vector<double> shapes = doubles_of(smpl_arrays(55, 20)["shapedirs"]);
  EXPECT_NEAR(model.shape[4].surface.offsets(0, 0), shapes[10], 1e-12);
}

TEST(Smpl, WeightsNotSummingToOne_AreNormalizedAndReported) {
  Arrays arrays = smpl_arrays(24, 10);
  EXPECT_TRUE(read_smpl(Npz(npz_bytes(arrays), "body.npz")).findings.empty());
  reinterpret_cast<float*>(arrays["weights"].data.data())[0] += 0.2f;
  const SmplBody body = read_smpl(Npz(npz_bytes(arrays), "body.npz"));
  EXPECT_NEAR(body.model.skin.weights.row(0).sum(), 1, 1e-12);
  EXPECT_NEAR(body.model.skin.weights(0, 0), 0.8 / 1.2, 1e-6);
  ASSERT_EQ(body.findings.size(), 1u);
  EXPECT_EQ(body.findings[0].code, "skin-weights-sum");
  EXPECT_THAT(body.findings[0].what, HasSubstr("1 vertices had weights that sum to 1"));
}

struct SmplDamage {
  const char* name;
  void (*spoil)(Arrays&);
  const char* where;
  const char* message;
};

class SmplRefusal : public ::testing::TestWithParam<SmplDamage> {};

TEST_P(SmplRefusal, SpoiledArray_IsRefusedWithWhatIsExpected) {
  Arrays arrays = smpl_arrays(24, 10);
  GetParam().spoil(arrays);
  EXPECT_THAT([&] { read(arrays); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("body.npz"), HasSubstr(GetParam().where),
                                             HasSubstr(GetParam().message))));
}

const SmplDamage kSmplDamages[] = {
    {"NoTemplate", [](Arrays& a) { a.erase("v_template"); }, "'v_template'", "missing"},
    {"NoWeights", [](Arrays& a) { a.erase("weights"); }, "'weights'", "missing"},
    {"NoRegressor", [](Arrays& a) { a.erase("J_regressor"); }, "'J_regressor'", "missing"},
    {"NoTree", [](Arrays& a) { a.erase("kintree_table"); }, "'kintree_table'", "missing"},
    {"NoPoseDirections", [](Arrays& a) { a.erase("posedirs"); }, "'posedirs'", "missing"},
    {"TemplateShape",
     [](Arrays& a) {
       a["v_template"] = zeros({kVertices, 4});
     },
     "shape [30,4]", "[V,3]"},
    {"ShapesShape",
     [](Arrays& a) {
       a["shapedirs"] = zeros({29, 3, 10});
     },
     "shape [29,3,10]", "30 vertices"},
    {"PosesShape",
     [](Arrays& a) {
       a["posedirs"] = zeros({kVertices, 3, 200});
     },
     "shape [30,3,200]", "P = 207 rotation entries (SMPL) or 93 (STAR)"},
    {"WeightsShape",
     [](Arrays& a) {
       a["weights"] = zeros({kVertices, 25});
     },
     "shape [30,25]", "24 joints (SMPL, STAR), 52 (SMPL-H) or 55 (SMPL-X)"},
    {"RegressorTransposed",
     [](Arrays& a) {
       a["J_regressor"] = zeros({kVertices, 24});
     },
     "shape [30,24]", "24 joints and 30 vertices"},
    {"TreeShape", [](Arrays& a) { a["kintree_table"] = table_of(smpl_parents(52)); },
     "shape [2,52]", "[2,24]"},
    {"Cycle",
     [](Arrays& a) {
       std::vector<int> parents = smpl_parents(24);
       parents[3] = 9;
       a["kintree_table"] = table_of(parents);
     },
     "spine1", "no cycles"},
    {"TwoRoots",
     [](Arrays& a) {
       std::vector<int> parents = smpl_parents(24);
       parents[3] = -1;
       a["kintree_table"] = table_of(parents);
     },
     "a second root", "one root"},
    {"ParentOutOfRange",
     [](Arrays& a) {
       std::vector<int> parents = smpl_parents(24);
       parents[3] = 24;
       a["kintree_table"] = table_of(parents);
     },
     "parent 24", "[0, 24)"},
    {"NoWeightAtAll",
     [](Arrays& a) {
       for (int j = 0; j < 24; ++j) {
         floats(a["weights"])[j] = 0;
       }
     },
     "skin weights of vertex 0", "no joint that moves it"},
    {"NanTemplate", [](Arrays& a) { floats(a["v_template"])[7] = NAN; }, "v_template", "finite"},
    {"InfDirections", [](Arrays& a) { floats(a["posedirs"])[7] = INFINITY; }, "posedirs", "finite"},
    {"FaceOutOfRange",
     [](Arrays& a) { reinterpret_cast<std::uint32_t*>(a["f"].data.data())[3] = 30; }, "index 30",
     "0 to 29"},
    {"Centimetres",
     [](Arrays& a) {
       for (std::size_t i = 0; i < 3 * kVertices; ++i) {
         floats(a["v_template"])[i] *= 100;
       }
     },
     "tall", "metres, Y up: 0.3 to 3"},
    {"TextTemplate",
     [](Arrays& a) {
       a["v_template"] = Tensor{ElementType::Text, {1, 3}, {}, {"a", "b", "c"}};
     },
     "v_template", ""},
};

INSTANTIATE_TEST_SUITE_P(Files, SmplRefusal, ::testing::ValuesIn(kSmplDamages),
                         [](const auto& damage) { return std::string(damage.param.name); });

TEST(Amass, WorldAxes_AreTurnedAndNothingElse) {
  const BodyModel model = t_posed(52, 16);
  const Arrays arrays = amass_arrays();
  const MotionClip clip = read_amass_arrays(arrays, &model);
  EXPECT_EQ(clip.motion.fps, 120);
  const std::vector<double> poses = doubles_of(arrays.at("poses"));
  const std::vector<double> trans = doubles_of(arrays.at("trans"));
  Eigen::VectorXd shape(10);
  for (int i = 0; i < 10; ++i) {
    shape[i] = doubles_of(arrays.at("betas"))[static_cast<std::size_t>(i)];
  }
  const Skeleton skeleton = shaped_skeleton(model, shape);
  for (std::size_t frame = 0; frame < 4; ++frame) {
    Pose z_up;
    z_up.rotations = Eigen::Map<const Points>(poses.data() + 156 * frame, 52, 3);
    z_up.root_translation = Eigen::Map<const Eigen::Vector3d>(trans.data() + 3 * frame);
    const Points was = forward_kinematics(skeleton, z_up).positions;
    const Points is = forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
    Points expected(was.rows(), 3);
    expected << was.col(0), was.col(2), -was.col(1);
    EXPECT_LT((is - expected).norm(), 1e-12);
  }
}

TEST(Amass, EveryPoseLayout_UsesAnAverageAdultSkeleton) {
  for (const std::int64_t columns : {72, 156, 165}) {
    const MotionClip clip = read_amass_arrays(amass_arrays(columns));
    EXPECT_EQ(clip.skeleton.names.size(), static_cast<std::size_t>(columns / 3));
    ASSERT_EQ(clip.findings.size(), 1u);
    EXPECT_EQ(clip.findings[0].code, "motion-skeleton");
    EXPECT_NEAR(leg_length(clip.skeleton, recognised_humanoid(clip.skeleton)), 0.83, 0.01);
  }
}

TEST(Amass, StageIIArrays_GiveTheSameMotion) {
  Arrays arrays = amass_arrays(165);
  const MotionClip whole = read_amass_arrays(arrays);
  const std::vector<double> poses = doubles_of(arrays["poses"]);
  arrays.erase("poses");
  arrays["mocap_frame_rate"] = arrays["mocap_framerate"];
  arrays.erase("mocap_framerate");
  const auto part = [&](const char* name, std::int64_t first, std::int64_t count) {
    std::vector<double> values;
    for (std::int64_t frame = 0; frame < 4; ++frame) {
      values.insert(values.end(), poses.begin() + frame * 165 + first,
                    poses.begin() + frame * 165 + first + count);
    }
    arrays[name] = tensor_of<double>(values, {4, count});
  };
  part("root_orient", 0, 3);
  part("pose_body", 3, 63);
  part("pose_jaw", 66, 3);
  part("pose_eye", 69, 6);
  part("pose_hand", 75, 90);
  const MotionClip parts = read_amass_arrays(arrays);
  EXPECT_EQ(parts.motion.poses[3].rotations, whole.motion.poses[3].rotations);
}

TEST(Amass, MalformedFiles_AreRefused) {
  const auto refused = [](void (*spoil)(Arrays&), const char* where, const char* message) {
    Arrays arrays = amass_arrays();
    spoil(arrays);
    EXPECT_THAT([&] { read_amass_arrays(arrays); },
                ThrowsMessage<DataError>(
                    AllOf(HasSubstr("walk_poses.npz"), HasSubstr(where), HasSubstr(message))));
  };
  refused([](Arrays& a) { a.erase("trans"); }, "'trans'", "missing");
  refused([](Arrays& a) { a.erase("poses"); }, "'root_orient'", "missing");
  refused([](Arrays& a) { a.erase("mocap_framerate"); }, "'mocap_framerate'", "missing");
  refused([](Arrays& a) { a["poses"] = zeros({4, 150}); }, "150 columns", "156 (SMPL-H)");
  refused([](Arrays& a) { a["poses"] = zeros({3, 156}); }, "3 frames", "4, as 'trans' has");
  refused([](Arrays& a) { a["trans"] = zeros({4, 2}); }, "trans", "");
  refused([](Arrays& a) { a["trans"] = zeros({0, 3}); }, "0 frames", "1 to");
  refused(
      [](Arrays& a) {
        a["trans"] = zeros({4, 3});
        floats(a["trans"])[5] = NAN;
      },
      "trans", "finite");
  refused([](Arrays& a) { a["mocap_framerate"] = tensor_of<double>(std::vector<double>{0}, {}); },
          "mocap_framerate", "more than 0");
}

// A person who stands in a file with Y up, as other programs write the arrays of AMASS.
TEST(Amass, StandingByYUp_IsDoubtedAndReadAsSaid) {
  Arrays arrays = amass_arrays();
  arrays["poses"] = zeros({4, 156});
  const Npz npz(npz_bytes(arrays), "y_up.npz");
  const auto doubted = [](const MotionClip& clip) {
    return finding_of(clip, "motion-up") != nullptr;
  };
  const auto head = [](const MotionClip& clip) -> Eigen::RowVector3d {
    const Points joints = forward_kinematics(clip.skeleton, clip.motion.poses[1]).positions;
    return joints.row(find_joint(clip.skeleton, "head")) - joints.row(0);
  };
  const MotionClip lies = read_amass(npz);
  EXPECT_TRUE(doubted(lies));
  EXPECT_LT(head(lies).z(), -0.4);
  const MotionClip stands = read_amass(npz, nullptr, {}, {.up = 'y'});
  EXPECT_FALSE(doubted(stands));
  EXPECT_GT(head(stands).y(), 0.4);
  const RowMatrix trans = matrix_of(arrays.at("trans"));
  EXPECT_NEAR((stands.motion.poses[1].root_translation - trans.row(1).transpose()).norm(), 0,
              1e-12);
  EXPECT_FALSE(doubted(read_amass(npz, nullptr, {}, {.up = 'z'})));
}

TEST(Amass, RotationsInDegrees_AreDoubted) {
  const RowMatrix radians = matrix_of(amass_arrays().at("poses"));
  const auto doubted = [&](double scale, double turns) {
    Arrays arrays = amass_arrays();
    RowMatrix poses = scale * radians;
    poses.leftCols(3).array() += turns * 2 * std::numbers::pi;
    arrays["poses"] = tensor_of_rows(poses);
    return finding_of(read_amass_arrays(arrays), "motion-degrees") != nullptr;
  };
  constexpr double kDegrees = 180 / std::numbers::pi;
  EXPECT_FALSE(doubted(1, 0));
  EXPECT_FALSE(doubted(1, 5));  // somebody who has turned about several times
  EXPECT_TRUE(doubted(kDegrees, 0));
  EXPECT_TRUE(doubted(0.1 * kDegrees, 0));  // a person who hardly bends
}

TEST(Amass, BodyAtAShape_KeepsRotationsAndPath) {
  const BodyModel model = t_posed(55, 20);
  const Arrays arrays = amass_arrays(165);
  const Npz npz(npz_bytes(arrays), "walk_stageii.npz");
  const Eigen::VectorXd shape = neutral_shape(model);
  const MotionClip clip = read_amass(npz, &model, shape, {.up = 'z'});
  EXPECT_EQ(clip.skeleton.offsets, shaped_skeleton(model, shape).offsets);
  ASSERT_EQ(clip.findings.size(), 2u);  // 16 betas, of which the body is read with 10
  EXPECT_EQ(clip.findings[0].code, "motion-betas");
  EXPECT_THAT(clip.findings[0].what, HasSubstr("6 of its 16 betas are beyond the 10"));
  EXPECT_EQ(clip.findings[1].code, "motion-shape");
  const RowMatrix poses = matrix_of(arrays.at("poses"));
  const RowMatrix trans = matrix_of(arrays.at("trans"));
  for (Index frame = 0; frame < 4; ++frame) {
    const Pose& pose = clip.motion.poses[static_cast<std::size_t>(frame)];
    EXPECT_EQ(pose.rotations.row(7), (poses.block<1, 3>(frame, 21)));
  }
  const Motion moved = retarget(clip, model, shape).motion;  // on the body itself
  for (std::size_t frame = 0; frame < 4; ++frame) {
    EXPECT_EQ(moved.poses[frame].rotations, clip.motion.poses[frame].rotations);
  }
  EXPECT_NEAR((moved.poses[3].root_translation - moved.poses[0].root_translation).norm(),
              (trans.row(3) - trans.row(0)).norm(), 1e-12);
}

/// A body with the arrays of SMPL-X, 330 vertices and a path of 1.5 m, in files of AMASS' second
/// stage: somebody who walks, and one who stands in a T-pose.
TEST(Amass, StageIIFilesOnTheirOwnBody_AreExact) {
  const std::filesystem::path files = source_directory() / "tests/bodymodel/files";
  const BodyModel body = read_body_file(files / "smplx_like.npz").model;
  ASSERT_EQ(body.skeleton.names.size(), 55U);
  for (const std::string name : {"walk", "tpose"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path file = files / (name + "_stageii.npz");
    const MotionClip clip = read_motion_file(file, of_body(body));
    for (const Finding& finding : clip.findings) {
      EXPECT_NE(finding.code, "motion-skeleton") << to_string(finding);  // the body is given
    }
    const std::vector<Pose> moved = retarget(clip, body).motion.poses;
    const Npz npz(file);
    const RowMatrix poses = matrix_of(npz.read("poses"));
    const RowMatrix trans = matrix_of(npz.read("trans"));
    ASSERT_EQ(std::ssize(moved), poses.rows());
    for (Index frame = 0; frame < poses.rows(); ++frame) {
      const Pose& pose = moved[static_cast<std::size_t>(frame)];
      for (Index joint = 1; joint < 55; ++joint) {
        const Eigen::Matrix3d there = rotation_matrix(poses.block<1, 3>(frame, 3 * joint));
        const Eigen::Matrix3d here = rotation_matrix(pose.rotations.row(joint));
        ASSERT_LT((here - there).cwiseAbs().maxCoeff(), 1e-6) << joint;
      }
    }
    const auto travel = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return (to - from).norm();
    };
    const double recorded = travel(trans.row(0), trans.bottomRows(1).transpose());
    EXPECT_NEAR(recorded, 1.5, 1e-6);
    EXPECT_NEAR(travel(moved.front().root_translation, moved.back().root_translation), recorded,
                1e-6);
    const Points stands = forward_kinematics(body.skeleton, moved.front()).positions;
    EXPECT_GT(stands(find_joint(body.skeleton, "head"), 1) -
                  stands(find_joint(body.skeleton, "pelvis"), 1),
              0.4);
  }
}

TEST(Amass, SiblingOfTheFamily_IsPosedByName) {
  const BodyModel model = t_posed(24, 10);  // without fingers
  const Arrays arrays = amass_arrays(156);
  const MotionClip clip = read_amass_arrays(arrays, &model);
  ASSERT_EQ(clip.skeleton.names.size(), 24u);
  const RowMatrix poses = matrix_of(arrays.at("poses"));
  EXPECT_EQ(clip.motion.poses[2].rotations.row(21), (poses.block<1, 3>(2, 63)));
  EXPECT_TRUE(clip.motion.poses[2].rotations.bottomRows(2).isZero(0));
  ASSERT_EQ(clip.findings.size(), 2u);
  EXPECT_EQ(clip.findings[0].code, "motion-betas");
  EXPECT_EQ(clip.findings[1].code, "motion-joints");
}

TEST(Amass, BodyOfAnotherFamily_IsNotTakenForOne) {
  BodyModel model = t_posed(24, 10);
  for (const char* name : {"left_elbow", "left_wrist"}) {  // an A-pose
    model.skeleton.offsets.row(find_joint(model.skeleton, name)) << 0.2, -0.2, 0;
  }
  EXPECT_FALSE(is_smpl_skeleton(model.skeleton));
  const MotionClip clip = read_amass_arrays(amass_arrays(72), &model);
  ASSERT_EQ(clip.findings.size(), 1u);
  EXPECT_EQ(clip.findings[0].code, "motion-skeleton");
}

}  // namespace
}  // namespace atelier::fixtures
