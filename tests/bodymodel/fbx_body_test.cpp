#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/formats/motion_file.h"
#include "bodymodel/formats/skin_weights.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "core/io/mesh_fbx.h"
#include "core/topology.h"
#include "tests/bodymodel/fbx_text.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/child_process.h"
#include "tests/support/needs_fbx.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::fbx_text;
using fixtures::FbxTextOptions;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

// MHR's and momentum's names.
fixtures::PersonNames mhr_bone_names() {
  return {"root",    "l_upleg",  "l_lowleg", "l_foot",     "l_ball",  "r_upleg",  "r_lowleg",
          "r_foot",  "r_ball",   "c_spine0", "c_spine3",   "c_neck",  "c_head",   "l_clavicle",
          "l_uparm", "l_lowarm", "l_wrist",  "r_clavicle", "r_uparm", "r_lowarm", "r_wrist"};
}

// Without what neither glTF nor FBX can hold.
BodyModel plain_body() {
  BodyModel model = fixtures::synthetic_body(40, 4);
  model.correctives.clear();
  model.shape.clear();
  model.groups.clear();
  return model;
}

GltfBody body_of(const std::string& text) {
  return read_gltf_body(read_fbx(std::as_bytes(std::span(text)), "a.fbx"), "a.fbx");
}

BodyModel through_gltf(const BodyModel& model) {
  const std::string bytes = glb_bytes(gltf_body(model));
  return read_gltf_body(read_gltf(std::as_bytes(std::span(bytes)), "a.glb"), "a.glb").model;
}

// The same tree by names, joints within 1e-6 m, weights, and vertices of a pose within 1e-6 of the
// body's height. Vertices of both come in the order in which faces name them first.
void expect_same_body(const BodyModel& a, const BodyModel& b, const char* which) {
  ASSERT_EQ(joint_count(a), joint_count(b)) << which;
  ASSERT_EQ(vertex_count(a), vertex_count(b)) << which;
  EXPECT_EQ(a.mesh.faces, b.mesh.faces) << which;
  std::vector<int> in_b;
  const Points rest_a = rest_positions(a.skeleton);
  const Points rest_b = rest_positions(b.skeleton);
  Pose pose_b = fixtures::random_pose(b.skeleton, 5, 0.3);
  Pose pose_a = pose_b;
  for (std::size_t j = 0; j < a.skeleton.names.size(); ++j) {
    const int other = find_joint(b.skeleton, a.skeleton.names[j]);
    ASSERT_GE(other, 0) << a.skeleton.names[j];
    in_b.push_back(other);
    const int parent_a = a.skeleton.parents[j];
    const int parent_b = b.skeleton.parents[static_cast<std::size_t>(other)];
    ASSERT_EQ(parent_a < 0, parent_b < 0);
    if (parent_a >= 0) {
      EXPECT_EQ(a.skeleton.names[static_cast<std::size_t>(parent_a)],
                b.skeleton.names[static_cast<std::size_t>(parent_b)]);
    }
    const auto row = static_cast<Index>(j);
    EXPECT_LT((rest_a.row(row) - rest_b.row(other)).norm(), 1e-6) << a.skeleton.names[j];
    pose_a.rotations.row(row) = pose_b.rotations.row(other);
  }
  for (Index v = 0; v < vertex_count(a); ++v) {
    std::map<int, double> difference;
    for (Index k = 0; k < a.skin.joints.cols(); ++k) {
      difference[in_b[static_cast<std::size_t>(a.skin.joints(v, k))]] += a.skin.weights(v, k);
    }
    for (Index k = 0; k < b.skin.joints.cols(); ++k) {
      difference[b.skin.joints(v, k)] -= b.skin.weights(v, k);
    }
    for (const auto& [joint, weight] : difference) {
      ASSERT_NEAR(weight, 0, 1e-6) << which << " vertex " << v << " joint " << joint;
    }
  }
  const Points skinned_a = skin_vertices(a, pose_a);
  const Points skinned_b = skin_vertices(b, pose_b);
  const double size = (skinned_b.colwise().maxCoeff() - skinned_b.colwise().minCoeff()).norm();
  const double apart = (skinned_a - skinned_b).cwiseAbs().maxCoeff() / size;
  std::printf("%s: skinned vertices %.2g of the size apart\n", which, apart);
  EXPECT_LT(apart, 1e-6) << which;
}

TEST(FbxBody, SmallBody_MatchesItsGltf) {
  ATELIER_NEEDS_FBX();
  const BodyModel model = plain_body();
  const BodyModel expected = through_gltf(model);
  for (const double centimetres : {1.0, 100.0, 2.54}) {
    for (const bool z_up : {false, true}) {
      FbxTextOptions options;
      options.centimetres = centimetres;
      options.z_up = z_up;
      const GltfBody body = body_of(fbx_text(model, options));
      EXPECT_TRUE(body.findings.empty());
      expect_same_body(body.model, expected,
                       (std::to_string(centimetres) + (z_up ? " cm, z up" : " cm, y up")).c_str());
    }
  }
}

TEST(FbxBody, DefaultHuman_MatchesItsGltf) {
  ATELIER_NEEDS_FBX();
  BodyModel model = default_human();
  model.correctives.clear();
  model.shape.clear();
  // glTF has four influences a vertex.
  model.skin = repair_skin_weights(model.skin, joint_count(model), {.max_slots = 4}).skin;
  const BodyModel read = body_of(fbx_text(model)).model;
  expect_same_body(read, through_gltf(model), "default human");
  // Split at the seams of the atlas in the file, one closed surface again.
  EXPECT_EQ(vertex_count(read), vertex_count(model));
  const Topology topology = topology_of(read.mesh.faces, vertex_count(read));
  EXPECT_TRUE(is_closed(topology));
  EXPECT_TRUE(is_manifold(manifold_defects(topology)));
  EXPECT_GT(read.mesh.uvs.rows(), vertex_count(read));
}

TEST(FbxBody, MhrNamesInCentimetres_AreReadAndRetargeted) {
  ATELIER_NEEDS_FBX();
  BodyModel person = fixtures::person_body(fixtures::person_skeleton(mhr_bone_names()));
  ShapeParameter taller;
  taller.name = "identity_0";
  taller.surface.offsets = Points::Constant(vertex_count(person), 3, 0.01);
  person.shape.push_back(taller);
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_fbx_lod1.FBX";
  std::ofstream(path) << fbx_text(person);
  const BodyFile file = read_body_file(path);
  fs::remove(path);
  EXPECT_TRUE(file.findings.empty());
  EXPECT_EQ(file.model.name, "atelier_fbx_lod1");
  EXPECT_LT((file.model.mesh.vertices - person.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
  ASSERT_EQ(file.model.shape.size(), 1u);
  EXPECT_EQ(file.model.shape[0].name, "identity_0");
  EXPECT_NEAR(file.model.shape[0].surface.offsets(7, 1), 0.01, 1e-6);
  const Humanoid humanoid = recognised_humanoid(file.model.skeleton);
  EXPECT_EQ(file.model.skeleton.names[static_cast<std::size_t>(humanoid.neck.back())], "c_head");
  const Retargeted moved = retarget(fixtures::person_clip(), file.model);
  EXPECT_EQ(moved.motion.poses.size(), 5u);
  EXPECT_NEAR(moved.scale, 1, 1e-5);
  EXPECT_TRUE(moved.findings.empty());
}

TEST(FbxBody, FileSavedInOtherPose_RestsInItsBindPose) {
  ATELIER_NEEDS_FBX();
  const BodyModel person = fixtures::person_body(fixtures::person_skeleton());
  FbxTextOptions options;
  options.moved.topLeftCorner<3, 3>() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  options.moved.topRightCorner<3, 1>() << 30, -20, 10;
  for (const bool carried : {false, true}) {  // the mesh's node by the root's, which has moved
    options.mesh_below_root = carried;
    const GltfBody body = body_of(fbx_text(person, options));
    EXPECT_LT((body.model.mesh.vertices - person.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((rest_positions(body.model.skeleton) - rest_positions(person.skeleton)).norm(), 1e-5);
  }
}

TEST(FbxBody, JointsWithoutSkin_AreKept) {
  ATELIER_NEEDS_FBX();
  BodyModel person = fixtures::person_body(fixtures::person_skeleton());
  person.skin.joints = (person.skin.joints.array() == 14)  // an arm in the middle
                           .select(13, person.skin.joints);
  person.skin.joints = (person.skin.joints.array() == 12)  // and the head, an end
                           .select(11, person.skin.joints);
  person.skin.joints = (person.skin.joints.array() == 0)  // and the root
                           .select(1, person.skin.joints);
  FbxTextOptions options;
  options.unweighted = false;
  const BodyModel read = body_of(fbx_text(person, options)).model;
  ASSERT_EQ(joint_count(read), 21);
  for (int j = 0; j < 21; ++j) {
    const auto row = static_cast<std::size_t>(j);
    const int found = find_joint(read.skeleton, person.skeleton.names[row]);
    ASSERT_GE(found, 0);
    EXPECT_LT(
        (rest_positions(read.skeleton).row(found) - rest_positions(person.skeleton).row(j)).norm(),
        1e-6);
  }
}

TEST(FbxBody, Weights_AreNormalizedAndPrunedToEight) {
  ATELIER_NEEDS_FBX();
  BodyModel model = fixtures::person_body(fixtures::person_skeleton());
  const Index count = vertex_count(model);
  model.skin.joints.resize(count, 12);
  model.skin.weights.resize(count, 12);
  for (Index v = 0; v < count; ++v) {
    for (int k = 0; k < 12; ++k) {
      model.skin.joints(v, k) = k;
      model.skin.weights(v, k) = 0.01 * (k + 1);  // 0.78 in all
    }
  }
  const GltfBody body = body_of(fbx_text(model));
  EXPECT_THAT(body.findings, Contains(Field(&Finding::code, "skin-weights-sum")));
  EXPECT_THAT(body.findings, Contains(Field(&Finding::code, "skin-weights-pruned")));
  EXPECT_EQ(body.model.skin.weights.cols(), 8);
  EXPECT_NEAR(body.model.skin.weights(0, 0), 12.0 / (12 + 11 + 10 + 9 + 8 + 7 + 6 + 5), 1e-6);
}

// One joint turns about x in a second, in an animation of that name.
struct FbxTurn {
  const char* name = "turn";
  double degrees = 90;
};

std::string with_animations(std::string text, const std::vector<FbxTurn>& turns) {
  std::string curves;
  std::string links;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const auto id = [&](int k) { return std::to_string(9000 + 10 * static_cast<int>(i) + k); };
    curves += "AnimationStack: " + id(0) + ", \"AnimStack::" + turns[i].name +
              "\", \"\" {\n}\nAnimationLayer: " + id(1) +
              ", \"AnimLayer::base\", \"\" {\n}\nAnimationCurveNode: " + id(2) +
              ", \"AnimCurveNode::R\", \"\" {\nProperties70: {\n"
              "P: \"d|X\", \"Number\", \"\", \"A\",0\nP: \"d|Y\", \"Number\", \"\", \"A\",0\n"
              "P: \"d|Z\", \"Number\", \"\", \"A\",0\n}\n}\n"
              "AnimationCurve: " +
              id(3) +
              ", \"AnimCurve::\", \"\" {\nDefault: 0\nKeyVer: 4008\n"
              "KeyTime: *3 {\na: 46186158000,69279237000,92372316000\n}\n"
              "KeyValueFloat: *3 {\na: 0," +
              std::to_string(turns[i].degrees / 2) + "," + std::to_string(turns[i].degrees) +
              "\n}\n}\n";
    links += "C: \"OO\"," + id(1) + "," + id(0) + "\nC: \"OO\"," + id(2) + "," + id(1) +
             "\nC: \"OP\"," + id(3) + "," + id(2) + ", \"d|X\"\nC: \"OP\"," + id(2) +
             ",1014, \"Lcl Rotation\"\n";
  }
  text.insert(text.find("}\nConnections: {\n"), curves);
  text.insert(text.rfind("}\n"), links);
  return text;
}

std::string with_animation(std::string text) {
  return with_animations(std::move(text), {FbxTurn{}});
}

TEST(FbxMotion, Animation_IsRead) {
  ATELIER_NEEDS_FBX();
  const BodyModel person = fixtures::person_body(fixtures::person_skeleton());
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_fbx_motion.fbx";
  std::ofstream(path) << with_animation(fbx_text(person));
  MotionFileOptions options;
  options.motion.fps = 10;
  const MotionClip clip = read_motion_file(path, options);
  fs::remove(path);
  ASSERT_EQ(clip.motion.poses.size(), 11u);
  const int arm = find_joint(clip.skeleton, person.skeleton.names[14]);
  EXPECT_NEAR(clip.motion.poses.front().rotations.row(arm).norm(), 0, 1e-6);
  EXPECT_NEAR(clip.motion.poses.back().rotations(arm, 0), 1.5707963, 1e-5);
  EXPECT_NEAR(clip.motion.poses[5].rotations(arm, 0), 0.7853982, 1e-5);
  EXPECT_LT(
      (rest_positions(clip.skeleton).row(arm) - rest_positions(person.skeleton).row(14)).norm(),
      1e-6);
}

TEST(FbxMotion, SeveralAnimations_AreEachSelectableAndTheDefaultIsSaid) {
  ATELIER_NEEDS_FBX();
  const BodyModel person = fixtures::person_body(fixtures::person_skeleton());
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_fbx_animations.fbx";
  const std::vector<FbxTurn> turns = {{"Wave", 40}, {"Bow", -60}, {"Kick", 80}};
  std::ofstream(path) << with_animations(fbx_text(person), turns);
  const auto end_of = [&](const std::string& wanted) {
    MotionFileOptions options;
    options.motion.animation = wanted;
    const MotionClip clip = read_motion_file(path, options);
    const int arm = find_joint(clip.skeleton, person.skeleton.names[14]);
    return std::pair(clip.motion.poses.back().rotations(arm, 0) * 180 / 3.14159265358979, clip);
  };
  const auto [angle, clip] = end_of("");
  EXPECT_NEAR(angle, 40, 1e-3) << "the first that moves a joint";
  EXPECT_THAT(clip.findings,
              Contains(AllOf(Field(&Finding::code, "motion-animations"),
                             Field(&Finding::what, HasSubstr("1 'Wave', 2 'Bow', 3 'Kick'")),
                             Field(&Finding::advice, HasSubstr("1 is taken")))));
  for (std::size_t i = 0; i < turns.size(); ++i) {
    for (const std::string& wanted : {std::string(turns[i].name), std::to_string(i + 1)}) {
      const auto [chosen, of] = end_of(wanted);
      EXPECT_NEAR(chosen, turns[i].degrees, 1e-3) << wanted;
      EXPECT_THAT(of.findings, Not(Contains(Field(&Finding::code, "motion-animations"))));
    }
  }
  EXPECT_THAT([&] { end_of("Jump"); }, ThrowsMessage<DataError>(HasSubstr("animation: 'Jump'")));
  fs::remove(path);
}

// Saved in mid-motion: the nodes stand neither in the bind pose nor in the first key's, and the
// mesh's own vertices are in the bind pose.
TEST(FbxMotion, FileSavedInMidMotion_IsReadByItsKeysFromItsBindPose) {
  ATELIER_NEEDS_FBX();
  const BodyModel person = fixtures::person_body(fixtures::person_skeleton());
  FbxTextOptions saved;
  saved.moved.topLeftCorner<3, 3>() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  saved.moved.topRightCorner<3, 1>() << 30, -20, 10;
  const std::string text = with_animation(fbx_text(person, saved));
  const GltfBody body = body_of(text);
  EXPECT_LT((body.model.mesh.vertices - person.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((rest_positions(body.model.skeleton) - rest_positions(person.skeleton)).norm(), 1e-5);
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_fbx_mid_motion.fbx";
  std::ofstream(path) << text;
  const MotionClip clip = read_motion_file(path);
  fs::remove(path);
  EXPECT_LT((rest_positions(clip.skeleton) - rest_positions(person.skeleton)).norm(), 1e-5);
  const int arm = find_joint(clip.skeleton, person.skeleton.names[14]);
  EXPECT_NEAR(clip.motion.poses.front().rotations.row(arm).norm(), 0, 1e-6);
  EXPECT_NEAR(clip.motion.poses.back().rotations(arm, 0), 1.5707963, 1e-5);
  // The root has no keys: it stays where the file has it, turned about y and 0.3 m aside.
  const Points there = forward_kinematics(clip.skeleton, clip.motion.poses.front()).positions;
  const Points rest = rest_positions(person.skeleton);
  const Eigen::Matrix3d turn = saved.moved.topLeftCorner<3, 3>();
  const Eigen::Vector3d shift = saved.moved.topRightCorner<3, 1>() / 100;
  for (Index j = 0; j < there.rows(); ++j) {
    const int ours = find_joint(person.skeleton, clip.skeleton.names[static_cast<std::size_t>(j)]);
    ASSERT_GE(ours, 0);
    EXPECT_LT((there.row(j).transpose() - turn * rest.row(ours).transpose() - shift).norm(), 1e-5)
        << clip.skeleton.names[static_cast<std::size_t>(j)];
  }
}

// Blender saves a body that it has read as glTF in its own way: an armature of scale 100, bones
// along y, leaf bones, a baked animation. Skips where Blender is not installed.
TEST(FbxBody, DefaultHuman_RoundTripsThroughBlender) {
  ATELIER_NEEDS_FBX();
  const fixtures::TemporaryDirectory folder;
  if (fixtures::run_child({"sh", "-c", "command -v blender"}).exit_code != 0) {
    GTEST_SKIP() << "no program blender (scripts/setup --judges)";
  }
  BodyModel model = default_human();
  model.correctives.clear();
  model.shape.clear();
  write_gltf(folder / "human.glb", gltf_body(model));
  std::ofstream(folder / "save.py") << R"(
import sys
import bpy, numpy
numpy.bool = bool  # the glTF reader of Blender 3.4 wants the name that NumPy 1.24 dropped
source, target = sys.argv[sys.argv.index('--') + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=source)
bpy.ops.export_scene.fbx(filepath=target)
)";
  ASSERT_EQ(
      fixtures::run_child({"blender", "--background", "--python", (folder / "save.py").string(),
                           "--", (folder / "human.glb").string(), (folder / "human.fbx").string()})
          .exit_code,
      0);
  const BodyModel back = read_body_file(folder / "human.fbx").model;
  const Points rest = rest_positions(model.skeleton);
  const Points rest_back = rest_positions(back.skeleton);
  double joints = 0;
  for (std::size_t j = 0; j < model.skeleton.names.size(); ++j) {
    const int other = find_joint(back.skeleton, model.skeleton.names[j]);
    ASSERT_GE(other, 0) << model.skeleton.names[j];
    joints = std::max(joints, (rest.row(static_cast<Index>(j)) - rest_back.row(other)).norm());
  }
  // Blender keeps no order of vertices that split at seams: each of ours is met by one of its own.
  ASSERT_EQ(vertex_count(back), vertex_count(model));
  EXPECT_TRUE(is_closed(topology_of(back.mesh.faces, vertex_count(back))));
  double vertices = 0;
  for (Index v = 0; v < vertex_count(model); ++v) {
    const Eigen::RowVector3d place = model.mesh.vertices.row(v);
    const double gap =
        std::sqrt((back.mesh.vertices.rowwise() - place).rowwise().squaredNorm().minCoeff());
    vertices = std::max(vertices, gap);
  }
  std::printf("joints %.2g m, vertices %.2g m apart\n", joints, vertices);
  EXPECT_LT(joints, 1e-5);
  EXPECT_LT(vertices, 1e-5);
}

TEST(FbxBodyRefused, DualQuaternions_AreRefused) {
  ATELIER_NEEDS_FBX();
  std::string text = fbx_text(fixtures::person_body(fixtures::person_skeleton()));
  const std::string skin = "\"Skin\" {\n";
  text.insert(text.find(skin) + skin.size(), "SkinningType: \"DualQuaternion\"\n");
  EXPECT_THAT([&] { body_of(text); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("blended by dual quaternions"), HasSubstr("Classic Linear"))));
}

TEST(FbxBody, BlendShapesThatWereSaved_AreNamed) {
  ATELIER_NEEDS_FBX();
  BodyModel person = fixtures::person_body(fixtures::person_skeleton());
  ShapeParameter taller;
  taller.name = "taller";
  taller.surface.offsets = Points::Constant(vertex_count(person), 3, 0.01);
  person.shape.push_back(taller);
  std::string text = fbx_text(person);
  const std::string field = "DeformPercent: 0\n";
  text.replace(text.find(field), field.size(), "DeformPercent: 40\n");
  const GltfBody body = body_of(text);
  EXPECT_THAT(body.findings, Contains(AllOf(Field(&Finding::code, "gltf-weights"),
                                            Field(&Finding::what, HasSubstr("taller 0.4")))));
  EXPECT_LT((body.model.mesh.vertices - person.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(FbxBodyRefused, FileWithoutBody_IsRefused) {
  ATELIER_NEEDS_FBX();
  BodyModel nobody = fixtures::person_body(fixtures::person_skeleton());
  std::string text = fbx_text(nobody);
  text.erase(text.find("C: \"OO\",300,100\n"), 16);  // the skin is not the mesh's
  EXPECT_THAT([&] { body_of(text); }, ThrowsMessage<DataError>(HasSubstr("no mesh with a skin")));
  nobody.skin.weights.row(3).setZero();
  EXPECT_THAT([&] { body_of(fbx_text(nobody)); },
              ThrowsMessage<DataError>(HasSubstr("no joint that moves it")));
  nobody.skin.weights.row(3).setConstant(-1);
  EXPECT_THAT([&] { body_of(fbx_text(nobody)); }, ThrowsMessage<DataError>(HasSubstr("weight -1")));
}

TEST(FbxBodyRefused, PersonInMetresDeclaredAsCentimetres_IsRefused) {
  ATELIER_NEEDS_FBX();
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_fbx_small.fbx";
  FbxTextOptions options;
  options.centimetres = 100;
  std::string text = fbx_text(fixtures::person_body(fixtures::person_skeleton()), options);
  const std::string said = "\"UnitScaleFactor\", \"double\", \"Number\", \"\",100";
  text.replace(text.find(said), said.size(), "\"UnitScaleFactor\", \"double\", \"Number\", \"\",1");
  std::ofstream(path) << text;
  EXPECT_THAT([&] { read_body_file(path); },
              ThrowsMessage<DataError>(HasSubstr("metres_per_unit = 100")));
  BodyFileOptions body;
  body.metres_per_unit = 100;
  EXPECT_NEAR(rest_positions(read_body_file(path, body).model.skeleton).col(1).maxCoeff(), 1.58,
              0.2);
  fs::remove(path);
}

TEST(FbxBodyRefused, NonFbxContent_IsRefused) {
  const fs::path path = fs::path(::testing::TempDir()) / "atelier_fbx_none.fbx";
  std::ofstream(path) << "solid cube\n";
  EXPECT_THAT([&] { read_body_file(path); },
              ThrowsMessage<DataError>(HasSubstr(
                  reads_fbx() ? "no FBX header" : "Blender imports FBX and exports glTF 2.0")));
  fs::remove(path);
}

}  // namespace
}  // namespace atelier
