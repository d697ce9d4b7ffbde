// `animate` of a sealed workspace: what it makes is where it was asked for, and nowhere else.
#if defined(ATELIER_HAS_CAPTURE_SURFACE) && defined(ATELIER_HAS_BODYMODEL)

#include <fstream>
#include <map>

#include <signal.h>
#include <unistd.h>

#include "core/exit_code.h"
#include "core/sha256.h"
#include "tests/apps/animate_fixture.h"
#include "tests/apps/places_with.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// The trunk's workspace, sealed to one.
class AnimateSealed : public Animate {
 protected:
  std::string place(const std::string& name) const { return (root_ / name).string(); }
  /// Seals what write_dressed_workspace makes; the recipient.
  std::string make_sealed(const std::string& who = "P. Doe", const std::string& scope = "research",
                          const std::string& purpose = "research") const {
    SmallCapture small;
    small.frames = {0, 1, 2};
    small.consent = {{who, scope, "2999-12-31"}};
    write_small_capture(capture(), small);
    write_dressed_workspace(capture(), workspace());
    const std::string told = run({"key", "--out", place("key")}).out;
    std::string recipient = told.substr(0, told.find('\n'));
    const ChildResult sealed = run({"seal", workspace().string(), "--to", recipient, "--out",
                                    place("p.sealed"), "--purpose", purpose});
    EXPECT_EQ(sealed.exit_code, 0) << sealed.err;
    return recipient;
  }
  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> all{"animate",
                                 capture().string(),
                                 place("p.sealed"),
                                 "--pictures",
                                 "false",
                                 "--cloth.xpbd.substeps",
                                 "6"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ChildResult sealed(const std::vector<std::string>& more) const { return run(command(more)); }
  /// Digests of all files of a result but its manifest.
  static std::map<std::string, std::string> digests(const fs::path& result) {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(fs::canonical(result))) {
      if (entry.is_regular_file() && entry.path().filename() != "manifest.json") {
        all[entry.path().lexically_relative(fs::canonical(result)).string()] =
            hex(sha256(read_file_text(entry.path(), 1 << 26)));
      }
    }
    return all;
  }
};

TEST_F(AnimateSealed, Folder_HasTheAnimationOfTheOpenWorkspaceAlone) {
  make_sealed();
  ASSERT_EQ(animate().exit_code, 0);
  const ChildResult done = sealed({"--identity", place("key"), "--out", place("out")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr(place("out")), Not(HasSubstr("atelier-private"))));
  EXPECT_EQ(digests(root_ / "out/animate/current"), digests(result()));
  std::vector<std::string> stages;
  for (const auto& entry : fs::directory_iterator(root_ / "out")) {
    stages.push_back(entry.path().filename().string());
  }
  EXPECT_THAT(stages, ::testing::UnorderedElementsAre("animate", "access.log"));
  EXPECT_THAT(run({"verify", place("out")}).out, HasSubstr("P. Doe, research"));
  EXPECT_THAT(run({"verify", "--log", place("out")}).out, HasSubstr("animate"));
  EXPECT_THAT(run({"verify", "--log", place("p.sealed")}).out,
              AllOf(HasSubstr("animate"), HasSubstr("out, for research"), HasSubstr("unbroken")));
  EXPECT_EQ(run({"export", place("out"), place("files")}).exit_code, 0);
}

TEST_F(AnimateSealed, To_SealsTheWorkspaceWithTheAnimationInIt) {
  const std::string recipient = make_sealed();
  const ChildResult done =
      sealed({"--identity", place("key"), "--out", place("q.sealed"), "--to", recipient});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(run({"verify", place("q.sealed"), "--identity", place("key")}).exit_code, 0);
  ASSERT_EQ(run({"unseal", place("q.sealed"), place("open"), "--identity", place("key")}).exit_code,
            0);
  ASSERT_EQ(animate().exit_code, 0);
  EXPECT_EQ(digests(root_ / "open/animate/current"), digests(result()));
  EXPECT_TRUE(fs::exists(root_ / "open/register/current"));
  EXPECT_THAT(run({"status", place("open"), "--digests"}).out, Not(HasSubstr("damaged")));
  EXPECT_THAT(run({"verify", "--log", place("open")}).out, HasSubstr("animate"));
}

TEST_F(AnimateSealed, WhatIsNotSaidOrDoesNotFit_IsRefused) {
  make_sealed();
  const auto refusal = [&](const std::vector<std::string>& more) {
    const ChildResult refused = sealed(more);
    EXPECT_EQ(refused.exit_code, kExitUsage) << refused.err;
    return refused.err;
  };
  EXPECT_THAT(refusal({"--out", place("out")}), HasSubstr("is sealed: --identity"));
  EXPECT_THAT(refusal({"--identity", place("key")}), HasSubstr("takes --out"));
  EXPECT_THAT(refusal({"--identity", place("key"), "--out", place("p.sealed")}),
              HasSubstr("--out"));
  EXPECT_THAT(refusal({"--identity", place("key"), "--out", place("out"), "--frames", "0:1"}),
              HasSubstr("--frames goes with a WORKSPACE that is a folder"));
  const ChildResult open = animate({"--out", place("out")});
  EXPECT_EQ(open.exit_code, kExitUsage);
  EXPECT_THAT(open.err, HasSubstr("is not sealed"));
  EXPECT_FALSE(fs::exists(root_ / "out"));
}

TEST_F(AnimateSealed, ErrorInTheSealedWorkspace_IsCalledByTheFile) {
  make_sealed();
  ASSERT_EQ(run({"unseal", place("p.sealed"), place("open"), "--identity", place("key")}).exit_code,
            0);
  fs::remove_all(root_ / "open/personalize");
  fs::remove(root_ / "p.sealed");
  const std::string told = read_file_text(root_ / "key", 1000);
  const std::string recipient = told.substr(told.find("age1"), 62);
  ASSERT_EQ(run({"seal", place("open"), "--to", recipient, "--out", place("p.sealed")}).exit_code,
            0);
  const ChildResult refused = sealed({"--identity", place("key"), "--out", place("out")});
  EXPECT_EQ(refused.exit_code, kExitBadData);
  EXPECT_THAT(refused.err,
              AllOf(HasSubstr(place("p.sealed/personalize")), Not(HasSubstr("atelier-private"))));
}

TEST_F(AnimateSealed, UseThatNobodyConsentedTo_IsRefusedThoughItIsThere) {
  const std::string recipient = make_sealed("P. Doe", "research internal");
  ASSERT_EQ(
      sealed({"--identity", place("key"), "--out", place("q.sealed"), "--to", recipient}).exit_code,
      0);
  fs::rename(root_ / "q.sealed", root_ / "p.sealed");
  const ChildResult refused =
      sealed({"--identity", place("key"), "--out", place("out"), "--purpose", "product"});
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err, HasSubstr("does not cover product"));
  EXPECT_FALSE(fs::exists(root_ / "out"));
  const ChildResult there = sealed({"--identity", place("key"), "--out", place("out")});
  EXPECT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.out, HasSubstr("is done already"));
}

TEST_F(AnimateSealed, KilledAnimation_LeavesNoPlainData) {
  const std::string name = "Z. Nobody-" + std::to_string(getpid());
  const std::string recipient = make_sealed(name);
  fs::remove_all(workspace());
  fs::remove_all(capture());
  SmallCapture small;  // the same images, and nobody's name beside them
  small.frames = {0, 1, 2};
  write_small_capture(capture(), small);
  const fs::path temporary = fs::temp_directory_path();
  ASSERT_THAT(places_with(name, temporary), IsEmpty());
  int killed = 0;
  for (int i = 0; i < 12; ++i) {
    const bool sealed_again = i % 2 == 1;
    std::vector<std::string> words =
        command({"--identity", place("key"), "--out", place(sealed_again ? "q.sealed" : "out")});
    if (sealed_again) {
      words.insert(words.end(), {"--to", recipient});
    }
    words.insert(words.begin(), program_path());
    ChildProcess child(words);
    usleep(static_cast<useconds_t>(i * 40'000));
    child.kill(SIGKILL);
    killed += child.wait().signal == SIGKILL ? 1 : 0;
    for (const char* asked : {"out", ".out.unfinished"}) {  // what was asked for may be there
      fs::remove_all(root_ / asked);
    }
    fs::remove(root_ / "q.sealed");
    EXPECT_THAT(places_with(name, temporary), IsEmpty()) << i;
    EXPECT_THAT(places_with(name, "/dev/shm"), IsEmpty()) << i;
  }
  EXPECT_GT(killed, 3);
}

}  // namespace
}  // namespace atelier::fixtures

#endif
