// `animate` with what one may give it: another body, motions of every format, the unloaded rest
// shape; and what other programs see of the result.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "bodymodel/formats/motion_file.h"
#include "capture/layouts/open_dataset.h"
#include "core/io/image_file.h"
#include "core/io/npz.h"
#include "core/normals.h"
#include "tests/apps/animate_fixture.h"
#include "tests/support/browser.h"

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

TEST_F(AnimateVariants, GarmentOnAnotherBody_KeepsItsSize) {
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

TEST_F(AnimateVariants, SameMotionInEveryFormat_GivesTheSameFrames) {
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

TEST_F(AnimateVariants, CaptureMotionInAFile_MatchesCaptureMotion) {
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

TEST_F(AnimateVariants, UnloadedRestShape_HangsNearerToTheRegistration) {
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
  const std::string rest = "simulated from its unloaded shape it hangs";
  EXPECT_THAT(hang("false", "10", "6"), Not(HasSubstr(rest)));
  const double sags = -0.3 - above_body(0, false);
  EXPECT_GT(sags, 0.005);
  EXPECT_THAT(hang("true", "10", "6"),
              AllOf(HasSubstr(rest), Not(HasSubstr("as with --cloth.relax false"))));
  EXPECT_LT(std::abs(-0.3 - above_body(0, false)), 0.8 * sags);
  // One round brings softer cloth no nearer than a centimetre: it is left as it is.
  hang("false", "3", "1");
  const Sequence without = skirt();
  EXPECT_THAT(hang("true", "3", "1"),
              AllOf(HasSubstr(rest), HasSubstr("as with --cloth.relax false")));
  EXPECT_EQ(distance(skirt(), without), 0);
}

TEST_F(AnimateVariants, Report_LoadsInABrowserWithEveryImage) {
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
  EXPECT_GE(found.images, 3) << "grid.png, strip.png, images";
  EXPECT_EQ(found.broken, 0);
  for (const char* one : {"personalize", "track", "template", "register", "material", "animate"}) {
    EXPECT_THAT(found.text, HasSubstr(one));
  }
  EXPECT_THAT(found.messages, Not(HasSubstr("CONSOLE")));
  // The film and its strip, what is wrong, the figures that matter, and only then the stages.
  const std::string page = read_file_text(workspace() / "report" / "index.html", 1 << 26);
  std::size_t last = 0;
  for (const char* part : {"<h1>", "<video", "alt=\"strip.png\"", "class=\"attention\"",
                           "<h2 id=\"figures\"", "<h2 id=\"personalize\"", "<h2 id=\"animate\""}) {
    const std::size_t at = page.find(part);
    ASSERT_NE(at, std::string::npos) << part;
    EXPECT_GT(at, last == 0 ? 0 : last) << part;
    last = at;
  }
}

TEST_F(AnimateVariants, Cameras_RoundTripThroughColmap) {
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

#ifdef ATELIER_HAS_APPEARANCE

/// Seen from the front.
Points2 atlas_coordinates(const Mesh& mesh) {
  Points2 uvs(mesh.vertices.rows(), 2);
  uvs.col(0) = 0.5 + mesh.vertices.col(0).array();
  uvs.col(1) = (mesh.vertices.col(1).array() - 0.5).min(1.0);
  return uvs;
}

/// A network of a surface that has learnt one texture: red on the left, green on the right.
/// @param drawn  with how much of it the surface was drawn in training
void write_network(const fs::path& file, const std::string& name, const Mesh& mesh,
                   const std::optional<DrawnRange>& drawn = {}) {
  constexpr int kSide = 16;
  AppearanceModel model;
  model.drawn = drawn;
  model.name = name;
  model.options.resolution = kSide;
  model.options.view_independent = model.options.view_dependent = model.options.shadow = false;
  model.faces = model.uv_faces = mesh.faces;
  model.uvs = atlas_coordinates(mesh);
  model.camera_ids = {"00"};
  model.static_texture = Image(kSide, kSide, 3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      model.static_texture.at(x, y, x < kSide / 2 ? 0 : 1) = 1;
    }
  }
  model.static_gain = {1, 1, 1};
  model.mean_transfer = MeanTransfer::Ones(mesh.vertices.rows(), kTransferTerms);
  for (const ParameterShape& parameter : network_parameters(model.options, 1)) {
    std::int64_t count = 1;
    for (const std::int64_t side : parameter.shape) {
      count *= side;
    }
    model.parameters[parameter.name] =
        tensor_of(std::vector<float>(static_cast<std::size_t>(count), 0.0F), parameter.shape);
  }
  std::vector<float> planes;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = c; i < model.static_texture.data.size(); i += 3) {
      planes.push_back(model.static_texture.data[i]);
    }
  }
  model.parameters["texture.mean"] = tensor_of(planes, {3, kSide, kSide});
  Safetensors content;
  content.tensors = tensors_of(model);
  content.metadata = texts_of(model);
  write_safetensors(file, content);
}

void write_skirt_network(StageRun& run) {
  run.output("lower/model.safetensors",
             [](const auto& file) { write_network(file, "lower", tube_skirt().mesh); });
}

void write_trunk_network(StageRun& run) {
  run.output("body/model.safetensors",
             [](const auto& file) { write_network(file, "body", trunk_body().mesh); });
}

/// The trunk as it is seen: in two colours, and 4 cm thicker.
void write_avatar(StageRun& run, const std::optional<DrawnRange>& drawn) {
  PersonalBody seen = plain_person(trunk_body());
  Mesh& mesh = seen.model.mesh;
  mesh.uvs = atlas_coordinates(mesh);
  mesh.uv_faces = mesh.faces;
  run.output("body/model.safetensors",
             [&](const auto& file) { write_network(file, "body", mesh, drawn); });
  mesh.vertices += 0.04 * vertex_normals(mesh.vertices, mesh.faces);
  run.output("avatar.npz", [&](const auto& file) { write_personal_body(file, seen); });
}
void write_trunk_avatar(StageRun& run) {
  write_avatar(run, {});
}
/// One that was never drawn as bright as its texture is.
void write_dim_avatar(StageRun& run) {
  write_avatar(run, DrawnRange{0.25, 0.5});
}

/// What `animate` draws by.
class AnimateDrawn : public AnimateVariants {
 protected:
  /// Recomputes the result of a stage, which some function writes in a moment.
  void make(const std::string& name, void (*write)(StageRun& run)) const {
    std::vector<Stage> stages(kDressedStages.begin(), kDressedStages.end());
    if (find_stage(stages, name) == nullptr) {
      const bool avatar = name == "avatar";
      stages.push_back({.name = avatar ? "avatar" : "appearance",
                        .summary = "one texture",
                        .inputs = {"capture"},
                        .outputs = {avatar ? "avatar" : "networks"},
                        .options = option_set<NoOptions>});
    }
    for (Stage& stage : stages) {
      if (stage.name == name) {
        stage.run = write;
        StageRequest request;
        request.input = capture();
        request.workspace = workspace();
        request.options = stage.options();
        request.force = true;
        run_stage(stages, stage, request);
      }
    }
  }
  /// The first two frames in small.
  ChildResult pictures(const std::vector<std::string>& more = {}) const {
    return stage("animate",
                 with_usual({"--width", "48", "--height", "64", "--samples", "1", "--seconds",
                             "0.01", "--cloth.xpbd.substeps", "6", "--background", "black"},
                            more));
  }
  static bool has_networks() {
    return fs::exists(fs::path(program_path()).parent_path() / "atelier-appearance");
  }
  /// How many pixels of the first image are of the networks' texture.
  int textured_pixels() const {
    const ByteImage picture = read_byte_image(result() / "pictures" / "000000.png");
    int count = 0;
    for (std::size_t i = 0; i < picture.data.size(); i += 3) {
      const int red = picture.data[i];
      const int green = picture.data[i + 1];
      count += std::abs(red - green) > 100 && picture.data[i + 2] < 30 ? 1 : 0;
    }
    return count;
  }
};

constexpr const char* kOneColour = "images have one colour each: ";

TEST_F(AnimateDrawn, NoNetworks_AreReportedAndOneColorIsUsed) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& words,
                           int code) {
    expect_refused(pictures(with_usual({"--drawn-by", "networks"}, more)), words, code);
    EXPECT_FALSE(fs::exists(workspace() / "animate")) << "nothing is simulated first";
  };
  refused({}, "no network of lower; run 'atelier appearance' first", 3);
  refused({"--garment", "none"}, "no network of body", 3);
  refused({"--garment", "tee"}, "networks are of registered garments", 2);
  refused({"--garment", "tee", "--dry-run"}, "networks are of registered garments", 2);
  const ChildResult plain = pictures({"--drawn-by", "plain"});
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_THAT(plain.out + plain.err, Not(HasSubstr(kOneColour)));
  const ChildResult unsaid = pictures();
  ASSERT_EQ(unsaid.exit_code, 0) << unsaid.err;
  EXPECT_THAT(unsaid.out + unsaid.err, HasSubstr(kOneColour + std::string("no network of lower")));
  const ChildResult none = animate();
  EXPECT_THAT(none.out + none.err, Not(HasSubstr(kOneColour))) << "no images are made";
}

TEST_F(AnimateDrawn, GarmentNetworks_TextureTheImages) {
  if (!has_networks()) {
    GTEST_SKIP() << "built without libtorch";
  }
  make("appearance", write_skirt_network);
  const ChildResult unsaid = pictures();
  ASSERT_EQ(unsaid.exit_code, 0) << unsaid.err;
  EXPECT_THAT(unsaid.out + unsaid.err, AllOf(Not(HasSubstr(kOneColour)), Not(HasSubstr("body, "))));
  const int textured = textured_pixels();
  EXPECT_GT(textured, 50);
  ASSERT_EQ(pictures({"--drawn-by", "networks"}).exit_code, 0);
  EXPECT_EQ(textured_pixels(), textured);
  ASSERT_EQ(pictures({"--drawn-by", "plain"}).exit_code, 0);
  EXPECT_EQ(textured_pixels(), 0);
  // The body alone has no network, then one.
  const ChildResult bare = pictures({"--garment", "none"});
  ASSERT_EQ(bare.exit_code, 0) << bare.err;
  EXPECT_THAT(bare.out + bare.err, HasSubstr("no network of body"));
  make("appearance", write_trunk_network);
  ASSERT_EQ(pictures({"--garment", "none", "--drawn-by", "networks"}).exit_code, 0);
  EXPECT_GT(textured_pixels(), 50);
  // Which is none of what is worn.
  EXPECT_EQ(pictures({"--drawn-by", "networks"}).exit_code, 3);
}

TEST_F(AnimateDrawn, Avatar_ShowsTheBodyAsItIsSeen) {
  make("avatar", write_trunk_avatar);
  const ChildResult done = pictures();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err, HasSubstr("clothes in images have one colour each"));
  EXPECT_GT(textured_pixels(), 50) << "without any network";
  const Sequence seen = open_sequence(result() / "seen");
  const Sequence bodies = body();
  ASSERT_EQ(frame_count(seen), frame_count(bodies));
  const Points off = frame(seen, 1).vertices - frame(bodies, 1).vertices;
  EXPECT_NEAR(off.rowwise().norm().mean(), 0.04, 1e-4);
  EXPECT_EQ(metrics()["seen_inverted"], 0);
  EXPECT_LT(metrics()["seen_stretch"], 1.5);
  ASSERT_EQ(pictures({"--drawn-by", "plain"}).exit_code, 0);
  EXPECT_EQ(textured_pixels(), 0);
  // Another body is nobody's avatar.
  ASSERT_EQ(pictures({"--garment", "none", "--body",
                      (workspace() / "personalize" / "current" / "person.npz").string()})
                .exit_code,
            0);
  EXPECT_EQ(textured_pixels(), 0);
  EXPECT_FALSE(fs::exists(result() / "seen"));
}

TEST_F(AnimateDrawn, MeshesOfTheSeenBody_AreDrawnAsTheBodyUnderThem) {
  if (!has_networks()) {
    GTEST_SKIP() << "built without libtorch";
  }
  make("avatar", write_trunk_avatar);
  make("appearance", write_skirt_network);
  ASSERT_EQ(pictures().exit_code, 0);
  const auto drawn = [&](const std::string& meshes) {
    const fs::path out = root_ / ("drawn-" + meshes);
    const ChildResult done = run({"render", "--neural", workspace().string(), "--out", out.string(),
                                  "--body", (result() / meshes).string(), "--garment",
                                  "lower=" + (result() / "garments" / "lower").string(), "--frames",
                                  "0", "--width", "48", "--height", "64"});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return read_byte_image(out / "000000.png").data;
  };
  const auto body = drawn("body");
  EXPECT_EQ(drawn("seen"), body);
}

TEST_F(AnimateDrawn, TextureBeyondWhatWasLearnt_IsReported) {
  if (!has_networks()) {
    GTEST_SKIP() << "built without libtorch";
  }
  make("appearance", write_skirt_network);
  make("avatar", write_dim_avatar);
  const ChildResult done = pictures();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out + done.err,
              HasSubstr("with 1.00 to 1.00 of its mean texture, and its network learnt from 0.25 "
                        "to 0.50"));
  EXPECT_NEAR(metrics()["drawn_high"], 1, 1e-3);
}

TEST_F(AnimateDrawn, DamagedAvatar_IsRefusedBeforeSimulation) {
  make("avatar", [](StageRun& run) {
    PersonalBody other = plain_person(trunk_body());
    other.model.mesh.faces.conservativeResize(other.model.mesh.faces.rows() - 2, 3);
    run.output("avatar.npz", [&](const auto& file) { write_personal_body(file, other); });
  });
  expect_refused(pictures(), "run 'atelier avatar' again", 3);
  EXPECT_FALSE(fs::exists(workspace() / "animate"));
}

TEST_F(AnimateDrawn, GarmentWithoutNetwork_IsNamed) {
  if (!has_networks()) {
    GTEST_SKIP() << "built without libtorch";
  }
  make("template", [](StageRun& run) {
    for (const char* name : {"lower", "upper"}) {
      run.output("garments/" + std::string(name) + ".h5", [name](const auto& file) {
        Garment skirt = tube_skirt();
        skirt.name = name;
        write_garment_archive(file, skirt);
      });
    }
    run.output_text("template.json", R"({"garments": [{"label": "lower", "frame": 0},
                                                      {"label": "upper", "frame": 0}]})");
  });
  make("register", [](StageRun& run) {
    for (const char* name : {"lower", "upper"}) {
      std::vector<Points> skirts = walking_skirt();
      for (Points& skirt : skirts) {
        skirt.col(1).array() += std::string(name) == "upper" ? 0.4 : 0;
      }
      write_meshes(run, "registered/" + std::string(name), tube_skirt().mesh.faces, skirts);
    }
  });
  make("appearance", write_skirt_network);
  for (const char* drawn_by : {"auto", "networks"}) {
    const ChildResult done = pictures({"--drawn-by", drawn_by, "--holding", "none"});
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_THAT(done.out + done.err, HasSubstr("no network of upper, drawn in one colour"));
    EXPECT_GT(textured_pixels(), 50);
  }
}

#ifdef ATELIER_HAS_ASSIMP

TEST_F(AnimateDrawn, ExportedAvatar_OpensInAssimpWithTexture) {
  make("appearance", write_skirt_network);
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
#endif

}  // namespace
}  // namespace atelier::fixtures

#endif
