// `avatar` on a small synthetic capture, and on what is missing from real ones.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL_TRACKING) && \
    defined(ATELIER_HAS_APPEARANCE)

#include <gmock/gmock.h>

#include "bodymodel/formats/personal_body.h"
#include "capture/capture_info.h"
#include "tests/apps/person_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PersonAvatar : public Person {
 protected:
  fs::path result() const { return workspace_ / "avatar" / "current"; }
  /// With a small texture, and without a network unless it is asked for.
  ChildResult avatar(const std::vector<std::string>& more = {}) const {
    return run_stage("avatar", with_usual({"--network", "false", "--resolution", "128", "--shading",
                                           "4", "--occlusion.strata", "3"},
                                          more));
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
