#include "bodymodel/formats/gltf_body.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/normals.h"
#include "core/unknown_value.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/places.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Without what glTF cannot hold.
BodyModel plain_gltf_body() {
  BodyModel model = fixtures::synthetic_body(40, 4);
  model.correctives.clear();
  model.shape.clear();
  return model;
}

Motion short_motion(const Skeleton& skeleton) {
  Motion motion;
  motion.fps = 30;
  for (int i = 0; i < 4; ++i) {
    motion.poses.push_back(fixtures::random_pose(skeleton, i, 0.3));
    motion.frame_ids.push_back(i);
  }
  return motion;
}

TEST(GltfMotion, MotionWithoutBody_ReadsBackEqual) {
  MotionClip clip = fixtures::person_clip();
  clip.skeleton.rest_rotations = Points::Zero(21, 3);
  clip.skeleton.rest_rotations.row(14) << 0, 0.2, -0.7;
  const std::string bytes = glb_bytes(gltf_motion(clip));
  const MotionClip back =
      read_gltf_motion(read_gltf(std::as_bytes(std::span(bytes)), "m.glb"), "m.glb");
  EXPECT_EQ(back.skeleton.names, clip.skeleton.names);
  ASSERT_EQ(back.motion.poses.size(), clip.motion.poses.size());
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[i]).positions;
    const Points is = forward_kinematics(back.skeleton, back.motion.poses[i]).positions;
    EXPECT_LT((is - was).cwiseAbs().maxCoeff(), 1e-5);  // float in the file
  }
  clip.motion.fps = 0;
  EXPECT_THROW(gltf_motion(clip), DataError);
}

TEST(GltfMotion, RoundedTimes_LoseNoFrame) {
  for (const double fps : {30.0, 40.0, 120.0}) {
    MotionClip clip = fixtures::person_clip();
    clip.motion.fps = fps;
    const Pose pose = clip.motion.poses.front();
    clip.motion.poses.assign(1300, pose);
    clip.motion.frame_ids.resize(1300);
    std::iota(clip.motion.frame_ids.begin(), clip.motion.frame_ids.end(), 0);
    const std::string bytes = glb_bytes(gltf_motion(clip));
    const GltfScene scene = read_gltf(std::as_bytes(std::span(bytes)), "m.glb");
    const MotionClip back = read_gltf_motion(scene, "m.glb");
    EXPECT_EQ(back.motion.poses.size(), 1300u) << fps;
    EXPECT_DOUBLE_EQ(back.motion.fps, fps);
    EXPECT_EQ(read_gltf_motion(scene, "m.glb", {0, 0, fps}).motion.poses.size(), 1300u) << fps;
  }
}

TEST(GltfBody, WrittenBody_ReadsBackEqual) {
  const BodyModel model = plain_gltf_body();
  const Motion motion = short_motion(model.skeleton);
  const std::string bytes = glb_bytes(gltf_body(model, {}, motion));
  const GltfScene scene = read_gltf(std::as_bytes(std::span(bytes)), "a.glb");
  const GltfBody back = read_gltf_body(scene, "a.glb");
  const MotionClip clip = read_gltf_motion(scene, "a.glb");
  ASSERT_EQ(joint_count(back.model), joint_count(model));
  ASSERT_EQ(vertex_count(back.model), vertex_count(model));
  ASSERT_EQ(clip.motion.poses.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    // float in the file
    EXPECT_LT(
        (skin_vertices(back.model, clip.motion.poses[i]) - skin_vertices(model, motion.poses[i]))
            .cwiseAbs()
            .maxCoeff(),
        1e-5);
  }
}

TEST(GltfBody, MoreThanFourInfluences_BecomeTheFourLargestOfSumOne) {
  BodyModel model = plain_gltf_body();
  const Index joints = joint_count(model);
  ASSERT_GE(joints, 6);
  model.skin.joints.resize(vertex_count(model), 6);
  model.skin.weights.resize(vertex_count(model), 6);
  for (Index v = 0; v < vertex_count(model); ++v) {
    model.skin.joints.row(v) << 0, 1, 2, 3, 4, 5;
    model.skin.weights.row(v) << 0.05, 0.3, 0.25, 0.2, 0.15, 0.05;
  }
  const GltfScene scene = gltf_body(model);
  const GltfPrimitive& primitive = scene.meshes[0].primitives[0];
  ASSERT_EQ(primitive.weights.cols(), 4);
  EXPECT_LT((primitive.weights.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-12);
  EXPECT_NEAR(primitive.weights(0, 0), 0.3 / 0.9, 1e-12);
  EXPECT_EQ(primitive.joints(0, 0), 1);
}

TEST(GltfBody, Scene_ShowsTheSameAsItsBody) {
  const BodyModel model = plain_gltf_body();
  const GltfScene scene = gltf_body(model);
  EXPECT_LT((rest_mesh(scene).vertices - model.mesh.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(GltfBody, Normals_AreWritten) {
  const BodyModel model = plain_gltf_body();
  const std::string bytes = glb_bytes(gltf_body(model));
  const GltfScene scene = read_gltf(std::as_bytes(std::span(bytes)), "a.glb");
  const Points normals = scene.meshes[0].primitives[0].mesh.normals;
  ASSERT_EQ(normals.rows(), vertex_count(model));
  EXPECT_LT((normals - vertex_normals(model.mesh.vertices, model.mesh.faces)).norm(), 1e-5);
}

TEST(GltfBody, Shape_IsBakedIn) {
  BodyModel model = fixtures::synthetic_body(40, 4);
  const Eigen::Vector2d shape(1.9, 1);
  const GltfBody back = read_gltf_body(gltf_body(model, shape));
  EXPECT_LT((back.model.mesh.vertices - shape_body(model, shape).vertices).norm(), 1e-9);
}

TEST(GltfBody, ScaledAndRotatedArmature_IsRead) {
  // As exporters write it: a parent node that turns and scales the whole skeleton, which the bind
  // matrices undo.
  const BodyModel model = plain_gltf_body();
  GltfScene scene = gltf_body(model);
  GltfNode armature;
  armature.name = "Armature";
  armature.scale = Eigen::Vector3d::Constant(0.01);
  armature.rotation =
      Eigen::Vector4d(std::sqrt(0.5), 0, 0, -std::sqrt(0.5));  // -90 degrees about x
  const int index = static_cast<int>(scene.nodes.size());
  scene.nodes.push_back(armature);
  scene.nodes[0].parent = index;
  scene.nodes.back().parent = -1;
  scene.roots[0] = index;
  const BodyModel back = read_gltf_body(scene).model;
  Points expected(40, 3);
  expected << model.mesh.vertices.col(0), model.mesh.vertices.col(2), -model.mesh.vertices.col(1);
  EXPECT_LT((back.mesh.vertices - 0.01 * expected).norm(), 1e-9);
  EXPECT_NEAR((rest_positions(back.skeleton).row(3) - rest_positions(back.skeleton).row(1)).norm(),
              0.01 * model.skeleton.offsets.row(3).norm(), 1e-9);
}

TEST(GltfBody, SplinesAndSteps_AreSampled) {
  GltfScene scene = gltf_body(plain_gltf_body());
  GltfChannel step{1, GltfPath::Rotation, GltfInterpolation::Step, {0, 1}, {}};
  step.values.resize(2, 4);
  step.values << 0, 0, 0, 1, 0, 0, 1, 0;
  GltfChannel curve{0, GltfPath::Translation, GltfInterpolation::CubicSpline, {0, 1}, {}};
  curve.values.setZero(6, 3);
  curve.values(4, 0) = 1;  // from 0 to 1 with flat ends: 3 s^2 - 2 s^3
  scene.animations = {{"a", {step, curve}}};
  const MotionClip clip = read_gltf_motion(scene, "a.glb", {0, 0, 4});
  ASSERT_EQ(clip.motion.poses.size(), 5u);
  const double x0 = clip.motion.poses[0].root_translation.x();
  EXPECT_NEAR(clip.motion.poses[1].root_translation.x() - x0, 3 * 0.0625 - 2 * 0.015625, 1e-9);
  EXPECT_EQ(clip.motion.poses[3].rotations.row(1), clip.motion.poses[0].rotations.row(1));
  EXPECT_NE(clip.motion.poses[4].rotations.row(1), clip.motion.poses[0].rotations.row(1));
}

bool found_in(const std::vector<Finding>& findings, const std::string& code) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& one) { return one.code == code; });
}

// A skin without inverse bind matrices, its mesh where it is seen, as one who forgot them has it.
TEST(GltfBody, ForgottenBindMatrices_LeaveJointsAtTheirNodes) {
  const GltfBody body =
      read_gltf_body(fixtures::source_directory() / "tests/bodymodel/files/no_ibm.gltf");
  const Points& offsets = body.model.skeleton.offsets;
  EXPECT_LT((offsets.row(0) - Eigen::RowVector3d(0, 0.95, 0)).norm(), 1e-6);
  EXPECT_LT((offsets.row(1) - Eigen::RowVector3d(0, 0.2, 0)).norm(), 1e-6);
  EXPECT_LT((offsets.row(2) - Eigen::RowVector3d(0, 0.45, 0)).norm(), 1e-6);
  EXPECT_NEAR(body.model.mesh.vertices.col(1).maxCoeff(), 1.75, 1e-6);
  EXPECT_NEAR(body.model.mesh.vertices.col(1).minCoeff(), 0.01, 1e-6);
  EXPECT_TRUE(found_in(body.findings, "gltf-binds"));
}

// The same with vertices in the frames of their joints, as the standard has it.
TEST(GltfBody, BindMatricesAppliedBefore_PlaceTheMeshByItsJoints) {
  const BodyModel model = fixtures::person_body(fixtures::person_skeleton());
  GltfScene scene = gltf_body(model);
  const Points joints = rest_positions(model.skeleton);
  GltfPrimitive& primitive = scene.meshes[0].primitives[0];
  for (Index v = 0; v < primitive.mesh.vertices.rows(); ++v) {
    primitive.mesh.vertices.row(v) -= joints.row(primitive.joints(v, 0));
  }
  for (Eigen::Matrix4d& bind : scene.skins[0].inverse_binds) {
    bind.setIdentity();
  }
  const GltfBody body = read_gltf_body(scene, "a.glb");
  EXPECT_LT((body.model.mesh.vertices - model.mesh.vertices).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((rest_positions(body.model.skeleton) - joints).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(found_in(body.findings, "gltf-binds"));
}

TEST(GltfMotion, SeveralAnimations_AreNamedAndChosen) {
  GltfScene scene = gltf_motion(fixtures::person_clip());
  scene.animations[0].name = "Walk";
  GltfAnimation still = scene.animations[0];
  still.name = "Idle";
  still.channels.resize(1);
  still.channels[0].values.setZero();
  scene.animations.insert(scene.animations.begin(), still);
  const MotionClip first = read_gltf_motion(scene, "a.glb");
  ASSERT_TRUE(found_in(first.findings, "motion-animations"));
  EXPECT_THAT(first.findings[0].what, HasSubstr("1 'Idle', 2 'Walk'"));
  EXPECT_EQ(first.name, "Idle");
  for (const char* wanted : {"Walk", "2"}) {
    MotionOptions options;
    options.animation = wanted;
    const MotionClip walk = read_gltf_motion(scene, "a.glb", options);
    EXPECT_EQ(walk.name, "Walk");
    EXPECT_TRUE(walk.findings.empty());
  }
  MotionOptions options;
  options.animation = "Run";
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb", options); },
              ThrowsMessage<UnknownValue>(HasSubstr("animation: 'Run'")));
}

TEST(GltfMotion, AnimatedNodesWithoutASkin_AreASkeleton) {
  const MotionClip clip = fixtures::person_clip();
  GltfScene scene = gltf_motion(clip);
  scene.skins.clear();
  const MotionClip back = read_gltf_motion(scene, "a.glb");
  ASSERT_EQ(back.skeleton.names.size(), clip.skeleton.names.size());
  for (std::size_t frame = 0; frame < clip.motion.poses.size(); ++frame) {
    const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
    const Points is = forward_kinematics(back.skeleton, back.motion.poses[frame]).positions;
    for (std::size_t j = 0; j < clip.skeleton.names.size(); ++j) {
      const int joint = find_joint(back.skeleton, clip.skeleton.names[j]);
      EXPECT_LT((was.row(static_cast<Index>(j)) - is.row(joint)).norm(), 1e-9);
    }
  }
  scene.animations[0].channels.clear();
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb"); },
              ThrowsMessage<DataError>(HasSubstr("no channel that turns or shifts a node")));
}

// A person beside those of `scene`, moved by the same animation: `motion` shifted by two metres.
void add_person(GltfScene& scene, const std::string& name, MotionClip clip) {
  clip.skeleton.offsets(0, 0) += 2;
  const GltfScene other = gltf_motion(clip);
  const int nodes = static_cast<int>(scene.nodes.size());
  for (GltfNode node : other.nodes) {
    node.parent = node.parent < 0 ? -1 : node.parent + nodes;
    scene.nodes.push_back(node);
  }
  for (const int root : other.roots) {
    scene.roots.push_back(root + nodes);
  }
  GltfSkin skin = other.skins.at(0);
  skin.name = name;
  for (int& joint : skin.joints) {
    joint += nodes;
  }
  scene.skins.push_back(skin);
  for (GltfChannel channel : other.animations.at(0).channels) {
    channel.node += nodes;
    scene.animations.at(0).channels.push_back(channel);
  }
}

GltfScene two_people() {
  GltfScene scene = gltf_motion(fixtures::person_clip());
  scene.skins[0].name = "Ada";
  add_person(scene, "Ben", fixtures::person_clip());
  return scene;
}

double root_x(const MotionClip& clip) {
  return clip.skeleton.offsets(0, 0) + clip.motion.poses[0].root_translation.x();
}

TEST(GltfMotion, TwoPeopleWhoMove_AreNamedAndChosen) {
  const GltfScene scene = two_people();
  const MotionClip first = read_gltf_motion(scene, "a.glb");
  ASSERT_TRUE(found_in(first.findings, "motion-skins"));
  EXPECT_THAT(first.findings[0].what, HasSubstr("2 skeletons, of the skins 1 'Ada', 2 'Ben'"));
  EXPECT_THAT(first.findings[0].advice, HasSubstr("--motion.skin NAME"));
  EXPECT_NEAR(root_x(first), 0, 1e-9);
  for (const char* wanted : {"Ben", "2"}) {
    MotionOptions options;
    options.skin = wanted;
    const MotionClip ben = read_gltf_motion(scene, "a.glb", options);
    EXPECT_NEAR(root_x(ben), 2, 1e-9) << wanted;
    EXPECT_FALSE(found_in(ben.findings, "motion-skins"));
  }
  MotionOptions options;
  options.skin = "Cy";
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb", options); },
              ThrowsMessage<UnknownValue>(AllOf(HasSubstr("skin: 'Cy'"), HasSubstr("2 'Ben'"))));
}

TEST(GltfMotion, AnimationOfTheSecondSkinAlone_IsThatPersons) {
  GltfScene scene = two_people();
  std::erase_if(scene.animations[0].channels, [&](const GltfChannel& channel) {
    const std::vector<int>& ada = scene.skins[0].joints;
    return std::find(ada.begin(), ada.end(), channel.node) != ada.end();
  });
  const MotionClip ben = read_gltf_motion(scene, "a.glb");
  EXPECT_NEAR(root_x(ben), 2, 1e-9);
  EXPECT_FALSE(found_in(ben.findings, "motion-skins"));
  MotionOptions options;
  options.skin = "Ada";
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb", options); },
              ThrowsMessage<DataError>(HasSubstr("no channel that moves a joint of the skeleton")));
}

TEST(GltfMotion, AnimationForEachSkin_IsChosenWithIt) {
  GltfScene scene = two_people();
  GltfAnimation second = scene.animations[0];
  second.name = "of Ben";
  const std::size_t half = second.channels.size() / 2;
  second.channels.erase(second.channels.begin(),
                        second.channels.begin() + static_cast<std::ptrdiff_t>(half));
  scene.animations[0].channels.resize(half);
  scene.animations.push_back(second);
  MotionOptions options;
  options.skin = "Ben";
  const MotionClip ben = read_gltf_motion(scene, "a.glb", options);
  EXPECT_EQ(ben.name, "of Ben");
  EXPECT_NEAR(root_x(ben), 2, 1e-9);
  options = {};
  options.animation = "of Ben";
  EXPECT_NEAR(root_x(read_gltf_motion(scene, "a.glb", options)), 2, 1e-9);
}

// Programs write a skin for each garment, with the joints that it needs.
TEST(GltfMotion, SkinsOfOneSkeleton_AreOnePersonWithAllJoints) {
  const MotionClip clip = fixtures::person_clip();
  GltfScene scene = gltf_motion(clip);
  GltfSkin shoes = scene.skins[0];
  shoes.joints.resize(5);
  shoes.inverse_binds.resize(5);
  scene.skins.insert(scene.skins.begin(), shoes);
  const MotionClip back = read_gltf_motion(scene, "a.glb");
  EXPECT_EQ(back.skeleton.names, clip.skeleton.names);
  EXPECT_FALSE(found_in(back.findings, "motion-skins"));
}

TEST(GltfMotion, TwoPeopleWithoutSkins_AreNamedAndChosen) {
  for (const bool below_a_root : {false, true}) {
    GltfScene scene = two_people();
    scene.skins.clear();
    if (below_a_root) {
      GltfNode root;
      root.name = "Scene";
      const int node = static_cast<int>(scene.nodes.size());
      for (const int person : scene.roots) {
        scene.nodes[static_cast<std::size_t>(person)].parent = node;
      }
      scene.nodes.push_back(root);
      scene.roots = {node};
    }
    const MotionClip first = read_gltf_motion(scene, "a.glb");
    EXPECT_TRUE(found_in(first.findings, "motion-skins"));
    EXPECT_NEAR(root_x(first), 0, 1e-9);
    MotionOptions options;
    options.skin = "2";
    EXPECT_NEAR(root_x(read_gltf_motion(scene, "a.glb", options)), 2, 1e-9);
  }
}

// Many rigs have a root that stays, below which Hips goes where the person goes.
TEST(GltfMotion, PathBelowAStillRoot_IsThePersons) {
  const MotionClip clip = fixtures::person_clip();
  GltfScene scene = gltf_motion(clip);
  GltfNode root;
  root.name = "root";
  scene.nodes.push_back(root);
  const int node = static_cast<int>(scene.nodes.size()) - 1;
  scene.nodes[0].parent = node;
  scene.roots = {node};
  scene.skins[0].joints.insert(scene.skins[0].joints.begin(), node);
  scene.skins[0].inverse_binds.insert(scene.skins[0].inverse_binds.begin(),
                                      Eigen::Matrix4d::Identity());
  const MotionClip back = read_gltf_motion(scene, "a.glb");
  EXPECT_TRUE(back.findings.empty());
  for (std::size_t frame = 0; frame < clip.motion.poses.size(); ++frame) {
    const Points was = forward_kinematics(clip.skeleton, clip.motion.poses[frame]).positions;
    const Points is = forward_kinematics(back.skeleton, back.motion.poses[frame]).positions;
    EXPECT_LT((was - is.bottomRows(was.rows())).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(GltfBody, OtherSkinnedMeshes_AreNamed) {
  GltfScene scene = gltf_body(plain_gltf_body());
  GltfNode hair = scene.nodes.back();
  hair.name = "hair";
  scene.roots.push_back(static_cast<int>(scene.nodes.size()));
  scene.nodes.push_back(hair);
  const GltfBody body = read_gltf_body(scene, "a.glb");
  ASSERT_TRUE(found_in(body.findings, "gltf-meshes"));
  EXPECT_THAT(body.findings[0].advice, HasSubstr("'hair'"));
}

TEST(GltfBody, MorphTargets_BecomeShapes) {
  GltfScene scene = gltf_body(plain_gltf_body());
  GltfMorphTarget target;
  target.positions = Points::Constant(40, 3, 0.1);
  scene.meshes[0].primitives[0].targets = {target};
  scene.meshes[0].target_names = {"smile"};
  const BodyModel model = read_gltf_body(scene).model;
  ASSERT_EQ(model.shape.size(), 1u);
  EXPECT_EQ(model.shape[0].name, "smile");
  EXPECT_NEAR(model.shape[0].surface.offsets(3, 1), 0.1, 1e-12);
}

TEST(GltfBody, RealPeople_AreLoadedAndMoved) {
  ATELIER_TEST_FILE(file, "gltf_skinned/mesh2motion/m2m-custom-animation-success.glb");
  const GltfBody body = read_gltf_body(file);
  const MotionClip clip = read_gltf_motion(file);
  EXPECT_EQ(joint_count(body.model), 66);
  EXPECT_TRUE(find_humanoid(body.model.skeleton).has_value());
  EXPECT_GT(clip.motion.poses.size(), 10u);
  for (const char* other : {"human-female.glb", "human-male.glb", "human-sophia.glb"}) {
    const GltfBody person = read_gltf_body(file.parent_path() / other);
    const Points& v = person.model.mesh.vertices;
    EXPECT_NEAR(v.col(1).maxCoeff() - v.col(1).minCoeff(), 1.8, 0.4) << other;
    // The animation moves any of them.
    const Retargeted moved = retarget(clip, person.model);
    EXPECT_TRUE(skin_vertices(person.model, moved.motion.poses[5]).allFinite()) << other;
  }
}

TEST(GltfBody, Fox_IsLoaded) {
  ATELIER_TEST_FILE(file, "gltf_skinned/bevy_fox/Fox.glb");
  const GltfBody body = read_gltf_body(file);
  const MotionClip clip = read_gltf_motion(file);
  EXPECT_TRUE(skin_vertices(body.model, clip.motion.poses.back()).allFinite());
}

TEST(GltfBody, NonBody_IsRefused) {
  const auto refused = [](void (*spoil)(GltfScene&), const char* message) {
    GltfScene scene = gltf_body(plain_gltf_body());
    spoil(scene);
    EXPECT_THAT([&] { read_gltf_body(scene, "a.glb"); },
                ThrowsMessage<DataError>(HasSubstr(message)));
  };
  refused([](GltfScene& s) { s.nodes.back().skin = -1; }, "a skinned mesh");
  refused([](GltfScene& s) { s.nodes[3].parent = -1; }, "two roots");
  refused([](GltfScene& s) { s.skins[0].joints.clear(); }, "no joints");
  refused([](GltfScene& s) { s.skins[0].inverse_binds[2](0, 0) = 5; }, "scales unevenly");
  refused([](GltfScene& s) { s.skins[0].inverse_binds[2].setZero(); }, "bind matrix");
  refused([](GltfScene& s) { s.meshes[0].primitives[0].joints.resize(0, 4); },
          "JOINTS_0 and WEIGHTS_0");
  refused([](GltfScene& s) { s.meshes[0].primitives[0].joints(3, 0) = 99; }, "a joint of the skin");
  refused([](GltfScene& s) { s.meshes[0].primitives[0].weights.row(7).setZero(); },
          "no joint that moves it");
}

TEST(GltfBody, NonMotion_IsRefused) {
  GltfScene scene = gltf_body(plain_gltf_body());
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb"); },
              ThrowsMessage<DataError>(HasSubstr("animations: none; expected a motion")));
  GltfChannel channel{static_cast<int>(scene.nodes.size()) - 1,
                      GltfPath::Translation,
                      GltfInterpolation::Linear,
                      {0, 1},
                      Eigen::MatrixXd::Zero(2, 3)};
  scene.animations = {{"camera", {channel}}};
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb"); },
              ThrowsMessage<DataError>(HasSubstr("no channel that moves a joint")));
  channel.node = 0;
  channel.times = {0, 1e9};
  scene.animations = {{"long", {channel}}};
  EXPECT_THAT([&] { read_gltf_motion(scene, "a.glb"); },
              ThrowsMessage<DataError>(HasSubstr("at most 1000000 frames")));
}

TEST(GltfBody, PosesOfOtherSkeleton_AreRefused) {
  const BodyModel model = plain_gltf_body();
  Motion motion = short_motion(model.skeleton);
  motion.poses[2].rotations.conservativeResize(3, 3);
  EXPECT_THAT([&] { gltf_body(model, {}, motion); },
              ThrowsMessage<LogicError>(HasSubstr("another skeleton")));
}

}  // namespace
}  // namespace atelier
