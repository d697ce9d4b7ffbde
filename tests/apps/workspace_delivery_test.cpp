// An avatar on its way to whom it is meant for: what `animate` draws says what it is, and a sealed
// one opens for those to whom it was sealed for as long as the consent lasts.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <algorithm>
#include <fstream>

#include "core/exit_code.h"
#include "core/io/image_file.h"
#include "core/sha256.h"
#include "tests/apps/animate_fixture.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Delivery : public Animate {
 protected:
  void SetUp() override {
    Animate::SetUp();
    if (!IsSkipped()) {
      SmallCapture small;
      small.frames = {0, 1, 2};
      small.consent = {{"P. Doe", "research", "2999-12-31"}};
      write_small_capture(capture(), small);
      write_dressed_workspace(capture(), workspace());
    }
  }

  std::string place(const std::string& name) const { return (root_ / name).string(); }
  static ChildResult verified(const fs::path& file, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"verify", file.string()};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  /// Two frames, large enough for a mark.
  ChildResult drawn(const std::string& workspace, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"animate", capture().string(), workspace, "--width",
                                   "400",     "--height",         "420",     "--samples",
                                   "1",       "--seconds",        "0.1",     "--garment",
                                   "none"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  /// A new key; its public part.
  std::string key(const std::string& name, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"key", "--out", place(name)};
    words.insert(words.end(), more.begin(), more.end());
    const ChildResult made = run(words);
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return made.out.substr(0, made.out.find('\n'));
  }
  std::string text(const fs::path& file) const { return read_file_text(file, 1 << 26); }
};

TEST_F(Delivery, ImagesFilmAndStrip_SayWhatTheyAre) {
  const ChildResult done = drawn(workspace().string());
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string statement = text(result() / "statement.json");
  const std::string mark = hex(sha256(statement)).substr(0, 16);
  for (const char* file : {"pictures/000001.png", "animation.mp4", "strip.png"}) {
    const ChildResult told = verified(result() / file);
    EXPECT_EQ(told.exit_code, 0) << told.out << told.err;
    EXPECT_THAT(told.out, AllOf(HasSubstr("synthetic (algorithmicMedia), by atelier"),
                                HasSubstr("P. Doe, research"), HasSubstr("shaded surfaces, "),
                                HasSubstr("personalize "), HasSubstr("signature: valid, by RW"),
                                HasSubstr("mark: " + mark + ", that of the credentials")))
        << file;
  }
  EXPECT_THAT(text(workspace() / "access.log"), HasSubstr("for research, mark " + mark));
  // The mark is left where credentials were cut off.
  write_image(root_ / "bare.jpg", read_byte_image(result() / "pictures/000001.png"),
              {.quality = 80});
  EXPECT_THAT(verified(root_ / "bare.jpg").out,
              AllOf(HasSubstr("synthetic, by its mark"), HasSubstr("mark: " + mark)));
  // The same again is the same to the bit.
  const std::string film = text(result() / "animation.mp4");
  ASSERT_EQ(drawn(workspace().string(), {"--force"}).exit_code, 0);
  EXPECT_EQ(text(result() / "animation.mp4"), film);
}

TEST_F(Delivery, MarkOffOrSigned_IsAsItWasAskedFor) {
  ASSERT_EQ(drawn(workspace().string(), {"--mark", "false"}).exit_code, 0);
  EXPECT_THAT(verified(result() / "animation.mp4").out, HasSubstr("nothing is known of it"));
  EXPECT_FALSE(fs::exists(result() / "statement.json"));
  EXPECT_THAT(text(workspace() / "access.log"), HasSubstr("without a mark"));
  const std::string signer = key("signer", {"--signing"});
  const ChildResult done = drawn(workspace().string(), {"--sign", place("signer")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(verified(result() / "animation.mp4").out, HasSubstr("valid, by " + signer));
  const ChildResult idle =
      drawn(workspace().string(), {"--sign", place("signer"), "--mark", "false"});
  EXPECT_EQ(idle.exit_code, kExitUsage);
  EXPECT_THAT(idle.err, HasSubstr("sign"));
  EXPECT_EQ(drawn(workspace().string(), {"--force", "--sign", place("gone")}).exit_code,
            kExitBadData);
}

TEST_F(Delivery, RenewedConsent_IsInTheFilm) {
  ASSERT_EQ(drawn(workspace().string()).exit_code, 0);
  const fs::path stated = capture() / "capture.toml";
  std::string changed = text(stated);
  changed.replace(changed.find("2999"), 4, "3999");
  std::ofstream(stated) << changed;
  ASSERT_EQ(drawn(workspace().string()).exit_code, 0);
  EXPECT_THAT(verified(result() / "animation.mp4").out, HasSubstr("until 3999-12-31"));
}

TEST_F(Delivery, AvatarForTwo_EndsWithItsConsentAndIsVerifiedFromItsFilm) {
  const std::string one = key("one");
  const std::string two = key("two");
  key("three");
  const ChildResult sealed = run(
      {"seal", workspace().string(), "--to", one, "--to", two, "--out", place("avatar.sealed")});
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  fs::remove_all(workspace());
  const auto animated = [&](const std::string& name, const std::string& out) {
    return drawn(place("avatar.sealed"), {"--identity", place(name), "--out", place(out)});
  };
  for (const std::string name : {"one", "two"}) {  // NOLINT(performance-for-range-copy)
    EXPECT_EQ(
        run({"unseal", place("avatar.sealed"), place("open_" + name), "--identity", place(name)})
            .exit_code,
        0);
    const ChildResult done = animated(name, "film_" + name);
    EXPECT_EQ(done.exit_code, 0) << done.err;
  }
  const ChildResult refused = animated("three", "film_three");
  EXPECT_EQ(refused.exit_code, kExitBadData);
  EXPECT_THAT(refused.err, HasSubstr("sealed to others"));
  EXPECT_FALSE(fs::exists(root_ / "film_three"));
  // The film says whose likeness it is and what for, by itself.
  const fs::path film = root_ / "film_two/animate/current/animation.mp4";
  const ChildResult told = verified(film);
  EXPECT_EQ(told.exit_code, 0) << told.out << told.err;
  EXPECT_THAT(told.out, AllOf(HasSubstr("P. Doe, research, until 2999-12-31; research covered"),
                              HasSubstr("signature: valid"), HasSubstr("that of the credentials")));
  EXPECT_EQ(std::count(told.out.begin(), told.out.end(), '\n'), 5);
  const std::string mark = told.out.substr(told.out.find("mark: ") + 6, 16);
  EXPECT_THAT(text(root_ / "film_two/access.log"), HasSubstr("mark " + mark));
  EXPECT_THAT(text(root_ / "avatar.sealed.log"), HasSubstr("mark " + mark));
  EXPECT_EQ(verified(film, {"--purpose", "product"}).exit_code, kExitCheckFailed);
  // The date is moved, where the consent is stated.
  const fs::path stated = capture() / "capture.toml";
  std::string ended = text(stated);
  ended.replace(ended.find("2999-12-31"), 10, "2020-01-01");
  std::ofstream(stated) << ended;
  for (const ChildResult& late :
       {animated("one", "late"),
        run({"export", place("avatar.sealed"), place("late"), "--identity", place("one")}),
        run({"seal", place("open_one"), "--to", one, "--out", place("late")})}) {
    EXPECT_EQ(late.exit_code, kExitCheckFailed) << late.err;
    EXPECT_THAT(late.err, AllOf(HasSubstr("ended with 2020-01-01"), HasSubstr("renew")));
    EXPECT_FALSE(fs::exists(root_ / "late"));
  }
  EXPECT_THAT(run({"validate", capture().string()}).out, HasSubstr("consent-ended"));
  // And one who withdrew it is known by the film, too.
  const std::string id = told.out.substr(told.out.find("consent: ") + 9, 16);
  std::ofstream(root_ / "revoked.txt") << id << " withdrawn\n";
  const ChildResult revoked = verified(film, {"--revoked", place("revoked.txt")});
  EXPECT_EQ(revoked.exit_code, kExitCheckFailed);
  EXPECT_THAT(revoked.out, HasSubstr("was revoked"));
}

}  // namespace
}  // namespace atelier::fixtures

#endif
