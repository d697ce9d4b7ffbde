#include "bodymodel/formats/body_file.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_size.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/retarget/retarget.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "tests/bodymodel/synthetic_person.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;
using fixtures::person_body;
using fixtures::person_clip;
using fixtures::person_skeleton;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

fs::path file(const std::string& name) {
  return fs::path(::testing::TempDir()) / ("atelier_body_file_" + name);
}

// Joints as MHR and momentum name them.
fixtures::PersonNames mhr_names() {
  return {"root",    "l_upleg",  "l_lowleg", "l_foot",     "l_ball",  "r_upleg",  "r_lowleg",
          "r_foot",  "r_ball",   "c_spine0", "c_spine3",   "c_neck",  "c_head",   "l_clavicle",
          "l_uparm", "l_lowarm", "l_wrist",  "r_clavicle", "r_uparm", "r_lowarm", "r_wrist"};
}

TEST(BodyFile, GltfOfMhrBody_IsReadAndRetargeted) {
  const fs::path path = file("mhr.glb");
  write_gltf(path, gltf_body(person_body(person_skeleton(mhr_names()))));
  const BodyModel model = read_body_file(path).model;
  const Humanoid person = recognised_humanoid(model.skeleton);
  EXPECT_EQ(model.skeleton.names[static_cast<std::size_t>(person.neck.back())], "c_head");
  EXPECT_EQ(model.skeleton.names[static_cast<std::size_t>(person.arms[0].elbow)], "l_lowarm");
  EXPECT_EQ(retarget(person_clip(), model).motion.poses.size(), 5u);
  fs::remove(path);
}

// What Blender makes of an FBX in centimetres, as MHR's are: an armature of scale 0.01 above the
// joints, whose bind matrices are in centimetres.
TEST(BodyFile, GltfArmatureInCentimetres_GivesAPersonInMetres) {
  const BodyModel person = person_body(person_skeleton(mhr_names()));
  GltfScene scene = gltf_body(scaled_body(person, 100));
  GltfNode armature;
  armature.name = "body_armature";
  armature.scale.setConstant(0.01);
  const int above = static_cast<int>(scene.nodes.size());
  for (const int root : scene.roots) {
    scene.nodes[static_cast<std::size_t>(root)].parent = above;
  }
  scene.roots = {above};
  scene.nodes.push_back(armature);
  GltfMorphTarget taller;
  taller.positions = 100 * Points::Constant(vertex_count(person), 3, 0.01);
  scene.meshes[0].primitives[0].targets = {taller};
  scene.meshes[0].target_names = {"identity_0"};
  const fs::path path = file("mhr_cm.glb");
  write_gltf(path, scene);
  const BodyModel model = read_body_file(path).model;
  EXPECT_LT((model.mesh.vertices - person.mesh.vertices).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT((rest_positions(model.skeleton) - rest_positions(person.skeleton)).norm(), 1e-5);
  ASSERT_EQ(model.shape.size(), 1u);
  EXPECT_EQ(model.shape[0].name, "identity_0");
  EXPECT_NEAR(model.shape[0].surface.offsets(7, 1), 0.01, 1e-6);
  const Retargeted moved = retarget(person_clip(), model);
  EXPECT_NEAR(moved.scale, 1, 1e-5);
  EXPECT_TRUE(moved.findings.empty());
  fs::remove(path);
}

TEST(BodyFile, OtherMhrFiles_AreRefusedWithAdvice) {
  const std::pair<const char*, const char*> refused[] = {
      {"mhr_model.pt", "can run code and is never loaded"},
      {"compact_v6_1.model", "without mesh and skin"},
      {"SMPL_MALE.pkl", "numpy.savez"}};
  for (const auto& [name, advice] : refused) {
    EXPECT_THAT([name = name] { read_body_file(name); },
                ThrowsMessage<DataError>(AllOf(HasSubstr(name), HasSubstr(advice))));
  }
  const fs::path path = file("corrective_blendshapes_lod1.npz");
  write_npz(path, {{"corrective_blendshapes",
                    tensor_of<float>(std::vector<float>(2 * 4 * 3, 0), {2, 4, 3})}});
  EXPECT_THAT([&] { read_body_file(path); },
              ThrowsMessage<DataError>(HasSubstr("MHR's pose correctives without a body")));
  write_npz(path,
            {{"0.sparse_indices", tensor_of<std::int64_t>(std::vector<std::int64_t>(4, 0), {2, 2})},
             {"0.sparse_weight", tensor_of<float>(std::vector<float>(2, 0), {2})},
             {"posedirs_sparse_mask", tensor_of<float>(std::vector<float>(4, 1), {2, 2})}});
  EXPECT_THAT([&] { read_body_file(path); },
              ThrowsMessage<DataError>(HasSubstr("MHR's pose correctives without a body")));
  fs::remove(path);
}

TEST(BodyFile, NonBodyFiles_AreRefused) {
  EXPECT_THAT([] { read_body_file("walk.bvh"); },
              ThrowsMessage<DataError>(HasSubstr("extension '.bvh'")));
  EXPECT_THAT([] { read_body_file("nobody"); },
              ThrowsMessage<DataError>(HasSubstr("default, female, male")));
}

}  // namespace
}  // namespace atelier
