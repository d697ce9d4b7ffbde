// `avatar` on a small synthetic capture, and on what is missing from real ones.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_APPEARANCE)

#include <csignal>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>

#include "appearance/body_surfaces.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "capture/capture_info.h"
#include "core/archive.h"
#include "core/io/safetensors.h"
#include "pipeline/avatar/avatar_result.h"
#include "tests/apps/person_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class PersonAvatar : public Person {
 protected:
  fs::path result() const { return workspace_ / "avatar" / "current"; }
  /// With a small texture, and without a network unless it is asked for.
  ChildResult avatar(const std::vector<std::string>& more = {}) const {
    return run_stage("avatar", with_usual({"--network", "false", "--resolution", "128", "--shading",
                                           "4", "--occlusion.strata", "3"},
                                          more));
  }
  static bool has_networks() {
    return fs::exists(fs::path(program_path()).parent_path() / "atelier-appearance");
  }
  /// The checkpoint of a training that was interrupted; "" where there is none.
  fs::path checkpoint() const {
    std::error_code gone;  // files come and go while a stage runs
    auto walk = fs::recursive_directory_iterator(workspace_ / "avatar", gone);
    for (; !gone && walk != fs::recursive_directory_iterator(); walk.increment(gone)) {
      if (walk->path().filename() == "checkpoint.safetensors") {
        return walk->path();
      }
    }
    return {};
  }
  static void flip_last_bit(const fs::path& file) {
    std::string bytes = read_text(file);
    bytes.back() = static_cast<char>(bytes.back() ^ 1);
    std::ofstream(file, std::ios::binary) << bytes;
  }
  /// Leaves `kept` scans of a kind of sequence.
  void remove_scans(const std::string& kind, std::size_t kept = 0) const {
    for (const CaptureSequence& sequence : read_capture_info(capture()).sequences) {
      if (sequence.kind == kind) {
        for (std::size_t i = kept; i < sequence.frame_ids.size(); ++i) {
          fs::remove(reconstructed("scans/" + frame_name(sequence.frame_ids[i]) + ".h5"));
        }
      }
    }
  }
};

TEST_F(PersonAvatar, CapturedPerson_HasHairShoesAndTexture) {
  ASSERT_EQ(run_stage("body").exit_code, 0);
  const ChildResult done = avatar();
  ASSERT_EQ(done.exit_code, 0) << done.err;
  for (const char* file : {"avatar.npz", "body/model.safetensors", "texture.png", "pictures.png"}) {
    EXPECT_TRUE(fs::exists(result() / file)) << file;
  }
  EXPECT_EQ(open_sequence(result() / "surface").frame_ids.size(), 6U);
  const BodyModel person =
      read_personal_body(workspace_ / "personalize" / "current" / "person.npz").model;
  const BodyModel seen = read_personal_body(result() / "avatar.npz").model;
  const Eigen::VectorXd off = (seen.mesh.vertices - person.mesh.vertices).rowwise().norm();
  EXPECT_GT(off.maxCoeff(), 0.015) << "hair has volume";
  EXPECT_LT(off.mean(), 0.015) << "skin is where it was";
  const ChildResult figures = evaluate({"--stage", "avatar", "--json"});
  ASSERT_EQ(figures.exit_code, 0) << figures.err;
  const nlohmann::json values = nlohmann::json::parse(figures.out);
  EXPECT_LT(values.at("avatar.mean_mm"), 30);
  EXPECT_TRUE(values.contains("avatar.hair_mm"));
  ASSERT_EQ(run_child({program_path(), "report", workspace_.string()}).exit_code, 0);
  EXPECT_THAT(read_text(workspace_ / "report" / "index.html"),
              HasSubstr("The body as it is seen, with hair and shoes"));
}

TEST_F(PersonAvatar, SameRunTwice_GivesTheSameBytes) {
  const std::vector<std::string> minimal = {"--kind", "minimal"};
  ASSERT_EQ(avatar(minimal).exit_code, 0);
  const std::string first = read_text(result() / "body" / "model.safetensors");
  std::vector<std::string> again = minimal;
  again.emplace_back("--force");
  ASSERT_EQ(avatar(again).exit_code, 0);
  EXPECT_TRUE(read_text(result() / "body" / "model.safetensors") == first);
}

TEST_F(PersonAvatar, Network_IsToldThePoseAndMovesTheSurface) {
  if (!has_networks()) {
    GTEST_SKIP() << "built without libtorch";
  }
  ASSERT_EQ(run_stage("body").exit_code, 0);
  const ChildResult done =
      avatar({"--network", "true", "--iterations", "30", "--code.latent", "4"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Safetensors file = read_safetensors(result() / "body" / "model.safetensors");
  EXPECT_EQ(file.metadata.at("network.latent"), "4");
  EXPECT_EQ(file.metadata.at("network.geometry"), "true");
  EXPECT_TRUE(file.tensors.contains("body.part"));
  EXPECT_TRUE(fs::exists(result() / "crops.png"));
  const BodyModel person =
      read_personal_body(workspace_ / "personalize" / "current" / "person.npz").model;
  const BodyAvatar seen = read_body_avatar(result(), person);
  EXPECT_TRUE(seen.posed);
  Pose bent = rest_pose(person.skeleton);
  bent.rotations.row(1) << 0.6, 0, 0;
  const TemporaryDirectory between;
  const std::string surfaces = (between / "surfaces.h5").string();
  const std::string moved = (between / "moved.h5").string();
  const std::string model = (result() / "body" / "model.safetensors").string();
  write_archive(
      surfaces,
      archive_of_surfaces(
          {seen_surface(seen, skin_vertices(person, rest_pose(person.skeleton))).cast<float>(),
           seen_surface(seen, skin_vertices(person, bent)).cast<float>()}));
  const std::string network =
      (fs::path(program_path()).parent_path() / "atelier-appearance").string();
  const ChildResult shaped = run_child({network, "shape", model, surfaces, moved});
  ASSERT_EQ(shaped.exit_code, 0) << shaped.err;
  const std::vector<FloatRows> offsets = surfaces_of(read_archive(moved, kSurfacesSchema, 1));
  ASSERT_EQ(offsets.size(), 2U);
  EXPECT_LT(offsets[1].cwiseAbs().maxCoeff(), 0.05F) << "m";
  EXPECT_EQ(run_child({network, "shape", model, surfaces, surfaces}).exit_code, 2);
  fs::resize_file(surfaces, 5000);
  EXPECT_EQ(run_child({network, "shape", model, surfaces, moved}).exit_code, 3);
  EXPECT_EQ(evaluate({"--stage", "avatar"}).exit_code, 0);
}

TEST_F(PersonAvatar, KilledTraining_ResumesAndRefusesADamagedCheckpoint) {
  if (!has_networks()) {
    GTEST_SKIP() << "built without libtorch";
  }
  const std::vector<std::string> longer = {"--network", "true",    "--iterations",       "400",
                                           "--kind",    "minimal", "--checkpoint-every", "20"};
  std::vector<std::string> command = {program_path(), "avatar", capture().string(),
                                      workspace_.string()};
  const std::vector<std::string> flags =
      with_usual({"--resolution", "128", "--shading", "4", "--occlusion.strata", "3"}, longer);
  command.insert(command.end(), flags.begin(), flags.end());
  sign_reconstruct();
  {
    const ChildProcess half(command);
    while (checkpoint().empty() && !half.has_ended()) {
      std::this_thread::yield();
    }
    half.kill(SIGKILL);
  }
  const fs::path left = checkpoint();
  ASSERT_FALSE(left.empty());
  flip_last_bit(left);
  const ChildResult damaged = run_child(command);
  EXPECT_EQ(damaged.exit_code, 3) << damaged.err;
  EXPECT_THAT(damaged.err, HasSubstr("give --force to train from the beginning"));
  flip_last_bit(left);
  const ChildResult again = run_child(command);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(fs::exists(result() / "body" / "model.safetensors"));
}

TEST_F(PersonAvatar, ExchangedCameras_AreNamed) {
  const TemporaryDirectory folder;
  fs::copy(capture(), folder / "capture", fs::copy_options::recursive);
  const auto exchange = [&](const char* what) {
    fs::rename(folder / "capture" / what / "00", folder / "aside");
    fs::rename(folder / "capture" / what / "04", folder / "capture" / what / "00");
    fs::rename(folder / "aside", folder / "capture" / what / "04");
  };
  exchange("images");
  exchange("labels");
  sign_reconstruct();
  const ChildResult done =
      run_child({program_path(), "avatar", (folder / "capture").string(), workspace_.string(),
                 "--replace", "--network", "false", "--kind", "minimal", "--resolution", "128",
                 "--shading", "4", "--occlusion.strata", "3"});
  EXPECT_THAT(done.err, HasSubstr("camera 00")) << done.exit_code;
  EXPECT_THAT(done.err, HasSubstr("camera 04"));
  EXPECT_THAT(done.err, Not(HasSubstr("camera 02")));
}

TEST_F(PersonAvatar, NoMinimalScan_TakesClothedFrames) {
  remove_scans("minimal");
  const ChildResult done = avatar({"--kind", "minimal"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("no minimally clothed frame has a scan: clothed ones are used"));
  EXPECT_EQ(open_sequence(result() / "surface").frame_ids.size(), 3U);
}

TEST_F(PersonAvatar, SingleFrame_IsEnoughAndSaid) {
  remove_scans("minimal", 1);
  const ChildResult done = avatar({"--kind", "minimal"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("is the only one"));
}

TEST_F(PersonAvatar, NoScans_LeaveTheBodyGrey) {
  remove_scans("minimal");
  remove_scans("clothed");
  const ChildResult refused = avatar();
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("the body has no appearance and stays grey"));
  EXPECT_FALSE(fs::exists(result()));
}

TEST_F(PersonAvatar, WrongTextureSize_IsRefusedAtOnce) {
  const ChildResult refused = avatar({"--resolution", "100"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("resolution cannot be 100"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
