// `animate` with what one may give it: another body, motions of every format, the unloaded rest
// shape; and what other programs see of the result.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <array>
#include <numbers>

#include "bodymodel/motion_file.h"
#include "capture/layouts/open_dataset.h"
#include "core/io/npz.h"
#include "tests/apps/animate_fixture.h"
#include "tests/apps/browser.h"

#ifdef ATELIER_HAS_APPEARANCE
#include "appearance/appearance_model.h"
#include "core/io/safetensors.h"
#endif
#ifdef ATELIER_HAS_ASSIMP
#include <assimp/Importer.hpp>

#include <assimp/scene.h>
#endif

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// An AMASS file (SMPL-H, Z up) of a motion that bends no joint but the root, the left shoulder and
/// the right knee.
void write_amass(const fs::path& file, const MotionClip& clip) {
  constexpr std::int64_t kColumns = 156;
  constexpr int kShoulder = 16;
  constexpr int kKnee = 5;
  const auto frames = static_cast<std::int64_t>(clip.motion.poses.size());
  std::vector<double> poses(static_cast<std::size_t>(frames * kColumns), 0);
  std::vector<double> trans;
  for (std::size_t i = 0; i < clip.motion.poses.size(); ++i) {
    const Pose& pose = clip.motion.poses[i];
    double* row = poses.data() + kColumns * static_cast<std::int64_t>(i);
    row[0] = std::numbers::pi / 2;  // a person who stands along z and faces -y
    for (Index c = 0; c < 3; ++c) {
      row[3 * kShoulder + c] = pose.rotations(14, c);
      row[3 * kKnee + c] = pose.rotations(6, c);
    }
    trans.insert(trans.end(), {pose.root_translation.x(), -pose.root_translation.z(), 0.9});
  }
  write_npz(file, {{"poses", tensor_of<double>(poses, {frames, kColumns})},
                   {"trans", tensor_of<double>(trans, {frames, 3})},
                   {"betas", tensor_of<double>(std::vector<double>(16, 0), {16})},
                   {"mocap_framerate", tensor_of<double>({clip.motion.fps}, {})}});
}

class AnimateVariants : public Animate {
 protected:
  void SetUp() override {
    Animate::SetUp();
    if (!IsSkipped()) {
      write_dressed_workspace(capture(), workspace());
    }
  }
  Sequence body() const { return open_sequence(result() / "body"); }
  Sequence skirt() const { return open_sequence(result() / "garments" / "lower"); }
  /// How high the skirt's waist or hem is over the middle of the trunk, m: as made, 0 and -0.3. The
  /// trunk has no feet, so that where it stands is no matter.
  double above_body(Index i, bool waist) const {
    const Points worn = frame(skirt(), i).vertices;
    const Points egg = frame(body(), i).vertices;
    return worn.col(1).segment(waist ? 0 : worn.rows() - 20, 20).mean() -
           (egg.col(1).minCoeff() + egg.col(1).maxCoeff()) / 2;
  }
  /// Largest distance of two sequences' vertices, of the first `rows` of each frame.
  static double distance(const Sequence& a, const Sequence& b, Index rows = -1) {
    EXPECT_EQ(frame_count(a), frame_count(b));
    double most = 0;
    for (Index i = 0; i < std::min(frame_count(a), frame_count(b)); ++i) {
      const Points off = frame(a, i).vertices - frame(b, i).vertices;
      most = std::max(most, off.topRows(rows < 0 ? off.rows() : rows).rowwise().norm().maxCoeff());
    }
    return most;
  }
};

TEST_F(AnimateVariants, TheGarmentIsCarriedToAnotherBodyAndKeepsItsSize) {
  BodyModel wide = trunk_body();
  const double chest = wide.mesh.vertices.col(0).maxCoeff();
  wide.mesh.vertices.col(0) *= 1.1;
  wide.mesh.vertices.col(2) *= 1.1;
  write_body(root_ / "wide.npz", wide);
  const ChildResult done = animate({"--body", (root_ / "wide.npz").string()});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  // It moves as the person does, in its own shape.
  EXPECT_NEAR(frame(body(), 0).vertices.col(0).maxCoeff(), 1.1 * chest, 2e-3);
  ASSERT_EQ(frame_count(skirt()), 3);
  EXPECT_LT(metrics()["penetration_depth"], 2e-3);
  EXPECT_LT(metrics()["strain_p99"], 0.15) << "a tenth more round the waist";
  for (Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(above_body(i, true), 0, 0.02) << "the waist is where it was";
    EXPECT_NEAR(above_body(i, false), -0.3, 0.05) << "the hem";
  }
}

TEST_F(AnimateVariants, TheSameMotionInEveryFormatGivesTheSameFrames) {
  const MotionClip clip = person_clip();
  ASSERT_EQ(animate({"--motion", motion(clip).string()}).exit_code, 0);
  const Sequence bodies = body();
  const Sequence skirts = skirt();
  ASSERT_EQ(frame_count(bodies), 5);
  for (const char* name : {"motion.npz", "motion.glb", "motion.gltf"}) {
    SCOPED_TRACE(name);
    const fs::path file = root_ / name;
    write_motion_file(file, clip);
    const ChildResult done = animate({"--motion", file.string()});
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_LT(distance(body(), bodies), 1e-4);
    EXPECT_LT(distance(skirt(), skirts), 2e-3);
  }
  // Another skeleton, whose legs are of another length: steps are as much shorter or longer.
  write_amass(root_ / "walk_poses.npz", clip);
  const ChildResult done = animate({"--motion", (root_ / "walk_poses.npz").string()});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_LT(distance(body(), bodies), 0.01);
  EXPECT_LT(distance(skirt(), skirts), 0.02);
}

TEST_F(AnimateVariants, TheCapturesMotionInAFileIsTheCapturesOwn) {
  ASSERT_EQ(animate().exit_code, 0);
  const Sequence bodies = body();
  const Sequence skirts = skirt();
  MotionClip clip;
  clip.name = "walk";
  clip.skeleton = short_walk().skeleton;
  clip.motion = short_walk().motion;
  ASSERT_EQ(animate({"--motion", motion(clip).string()}).exit_code, 0);
  EXPECT_LT(distance(body(), bodies), 1e-3);
  // Cloth has hung for a while where before it began as it was registered: its waist is the same.
  EXPECT_LT(distance(skirt(), skirts, 20), 0.01);
}

TEST_F(AnimateVariants, AnUnloadedRestShapeHangsNearerToWhereTheGarmentWasRegistered) {
  // Cloth that its own weight stretches, on a person who stands still.
  MotionClip still = person_clip();
  still.motion.poses.resize(1);
  still.motion.frame_ids.resize(1);
  const std::string file = motion(still).string();
  const auto hang = [&](const std::string& relax, const std::string& stretch,
                        const std::string& rounds) {
    ChildResult done = animate({"--motion", file, "--settle", "1", "--material.stretch-warp",
                                stretch, "--material.stretch-weft", stretch, "--material.bending",
                                "1e-3", "--cloth.rest_angles", "template", "--cloth.relax", relax,
                                "--cloth.relaxing.rounds", rounds});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done.out + done.err;
  };
  const std::string rest = "without its weight it hangs";
  EXPECT_THAT(hang("false", "10", "6"), Not(HasSubstr(rest)));
  const double sags = -0.3 - above_body(0, false);
  EXPECT_GT(sags, 0.005);
  EXPECT_THAT(hang("true", "10", "6"), AllOf(HasSubstr(rest), Not(HasSubstr("warning"))));
  EXPECT_LT(std::abs(-0.3 - above_body(0, false)), 0.8 * sags);
  // One round brings softer cloth no nearer than a centimetre: it is left as it is.
  hang("false", "3", "1");
  const Sequence without = skirt();
  EXPECT_THAT(hang("true", "3", "1"),
              AllOf(HasSubstr(rest), HasSubstr("as without --cloth.relax")));
  EXPECT_EQ(distance(skirt(), without), 0);
}

TEST_F(AnimateVariants, ItsReportLoadsInABrowserWithEveryPicture) {
  if (!has_browser()) {
    GTEST_SKIP() << "no program chromium (scripts/setup)";
  }
  ASSERT_EQ(
      stage("material", {"--search.coarse", "2", "--search.fine", "0", "--edge-length", "0.06"})
          .exit_code,
      0);
  ASSERT_EQ(stage("animate", {"--width", "60", "--height", "80", "--samples", "1",
                              "--cloth.xpbd.substeps", "6"})
                .exit_code,
            0);
  const ChildResult done = run({"report", workspace().string()});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const BrowsedPage found = browse(workspace() / "report" / "index.html", root_.path());
  EXPECT_GE(found.images, 3) << "grid.png, strip.png, pictures";
  EXPECT_EQ(found.broken, 0);
  for (const char* one : {"personalize", "track", "template", "register", "material", "animate"}) {
    EXPECT_THAT(found.text, HasSubstr(one));
  }
  EXPECT_THAT(found.messages, Not(HasSubstr("CONSOLE")));
}

TEST_F(AnimateVariants, CamerasAreExportedForColmapAndReadBack) {
  const fs::path out = root_ / "out";
  const ChildResult done = run(
      {"export", workspace().string(), out.string(), "--stage", "track", "--cameras", "colmap"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("cameras, colmap, 3 cameras"));
  const Dataset was = open_dataset(capture());
  const Dataset is = open_dataset(out / "cameras" / "clothed");
  ASSERT_EQ(is.cameras.size(), was.cameras.size());
  for (std::size_t i = 0; i < was.cameras.size(); ++i) {
    EXPECT_EQ(is.cameras[i].width, was.cameras[i].width);
    EXPECT_NEAR(is.cameras[i].fx, was.cameras[i].fx, 1e-6 * was.cameras[i].fx);
    EXPECT_LT((camera_center(is.cameras[i]) - camera_center(was.cameras[i])).norm(), 1e-6);
  }
  EXPECT_EQ(is.info.sequences.at(0).frame_ids.size(), 1u);
}

#if defined(ATELIER_HAS_APPEARANCE) && defined(ATELIER_HAS_ASSIMP)

/// A network of the skirt that has learnt one texture: red on the left, green on the right.
void write_skirt_network(const fs::path& file) {
  constexpr int kSide = 16;
  const Mesh skirt = tube_skirt().mesh;
  AppearanceModel model;
  model.name = "lower";
  model.options.resolution = kSide;
  model.options.view_independent = model.options.view_dependent = model.options.shadow = false;
  model.faces = model.uv_faces = skirt.faces;
  model.uvs.resize(skirt.vertices.rows(), 2);
  model.uvs.col(0) = 0.5 + skirt.vertices.col(0).array();
  model.uvs.col(1) = skirt.vertices.col(1).array() - 0.5;
  model.camera_ids = {"00"};
  model.static_texture = Image(kSide, kSide, 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      model.static_texture.at(x, y, x < kSide / 2 ? 0 : 1) = 1;
    }
  }
  model.static_gain = {1, 1, 1};
  model.mean_transfer = MeanTransfer::Ones(skirt.vertices.rows(), kTransferTerms);
  for (const ParameterShape& parameter : network_parameters(model.options, 1)) {
    std::int64_t count = 1;
    for (const std::int64_t side : parameter.shape) {
      count *= side;
    }
    model.parameters[parameter.name] =
        tensor_of(std::vector<float>(static_cast<std::size_t>(count), 0.0F), parameter.shape);
  }
  Safetensors content;
  content.tensors = tensors_of(model);
  content.metadata = texts_of(model);
  write_safetensors(file, content);
}

TEST_F(AnimateVariants, AnotherProgramOpensTheAvatarWithItsTexture) {
  std::array<Stage, kDressedStages.size() + 1> stages;
  std::copy(kDressedStages.begin(), kDressedStages.end(), stages.begin());
  const Stage& appearance = stages.back() = Stage{
      .name = "appearance",
      .summary = "one texture",
      .inputs = {"capture"},
      .outputs = {"networks"},
      .options = option_set<NoOptions>,
      .run = [](StageRun& run) {
        run.output("lower/model.safetensors", [](const auto& file) { write_skirt_network(file); });
      }};
  StageRequest request;
  request.input = capture();
  request.workspace = workspace();
  request.options = appearance.options();
  run_stage(stages, appearance, request);
  ASSERT_EQ(animate().exit_code, 0);
  const ChildResult done =
      run({"export", workspace().string(), (root_ / "out").string(), "--stage", "animate"});
  ASSERT_EQ(done.exit_code, 0) << done.err;

  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile((root_ / "out/animate/avatar.glb").string(), 0);
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumMeshes, 2u);
  EXPECT_EQ(scene->mMeshes[0]->mNumBones, person_skeleton().names.size());
  EXPECT_EQ(scene->mNumAnimations, 1u);
  const aiMesh& skirt = *scene->mMeshes[1];
  EXPECT_TRUE(skirt.HasTextureCoords(0));
  EXPECT_GE(skirt.mNumAnimMeshes, 2u);
  aiString path;
  ASSERT_EQ(scene->mMaterials[skirt.mMaterialIndex]->GetTexture(aiTextureType_DIFFUSE, 0, &path),
            aiReturn_SUCCESS);
  const aiTexture* texture = scene->GetEmbeddedTexture(path.C_Str());
  ASSERT_NE(texture, nullptr) << path.C_Str();
  ASSERT_EQ(texture->mHeight, 0u) << "compressed, as a file would be";
  const auto* bytes = reinterpret_cast<const std::byte*>(texture->pcData);
  const Image picture = read_image({bytes, texture->mWidth}, "texture");
  ASSERT_EQ(picture.width, 16);
  EXPECT_NEAR(picture.at(2, 8, 0), 1, 0.01);
  EXPECT_NEAR(picture.at(13, 8, 1), 1, 0.01);
  EXPECT_NEAR(picture.at(13, 8, 0), 0, 0.01);
}

#endif

}  // namespace
}  // namespace atelier::fixtures

#endif
