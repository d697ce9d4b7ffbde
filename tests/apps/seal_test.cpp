// `key`, `seal` and `unseal`: who can open a workspace, and what is left of a failure.

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include <pty.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include "core/exit_code.h"
#include "tests/apps/seal_fixture.h"
#include "tests/apps/simulate_fixture.h"
#include "tests/support/outside_judge.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

namespace fs = std::filesystem;

/// The program on a terminal of its own, at which somebody types.
class OnTerminal {
 public:
  explicit OnTerminal(std::vector<std::string> words) {
    words.insert(words.begin(), program_path());
    std::vector<char*> pointers;
    for (std::string& word : words) {
      pointers.push_back(word.data());
    }
    pointers.push_back(nullptr);
    child_ = forkpty(&terminal_, nullptr, nullptr, nullptr);
    if (child_ == 0) {
      execv(pointers[0], pointers.data());
      _exit(127);
    }
  }
  ~OnTerminal() {
    end();
    close(terminal_);
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  /// Reads until the program has said this, or has ended; all that it said.
  const std::string& until(const std::string& text) {
    char letter = 0;
    while (said_.find(text) == std::string::npos && read(terminal_, &letter, 1) == 1) {
      said_ += letter;
    }
    return said_;
  }
  void type(const std::string& text) const {
    EXPECT_EQ(write(terminal_, text.data(), text.size()), std::ssize(text));
  }
  bool echoes() const {
    termios now{};
    EXPECT_EQ(tcgetattr(terminal_, &now), 0);
    return (now.c_lflag & ECHO) != 0;
  }
  /// As waitpid gives it, and all that the program said.
  int end() {
    until(std::string(1, '\0'));
    if (child_ > 0) {
      waitpid(std::exchange(child_, -1), &status_, 0);
    }
    return status_;
  }
  const std::string& said() const { return said_; }

 private:
  pid_t child_ = -1;
  int terminal_ = -1;
  int status_ = 0;
  std::string said_;
};

TEST_F(Seal, PassphraseOfATerminal_IsTypedTwiceUnseen) {
  make_workspace();
  const std::vector<std::string> words = {"seal", workspace().string(), "--passphrase", "--out",
                                          place("p.sealed")};
  {
    OnTerminal slip(words);
    slip.until("passphrase: ");
    EXPECT_FALSE(slip.echoes());
    slip.type("correct horse\n");
    slip.until("again: ");
    slip.type("correct hoarse\n");
    EXPECT_EQ(WEXITSTATUS(slip.end()), kExitUsage);
    EXPECT_THAT(slip.said(), AllOf(HasSubstr("differ"), Not(HasSubstr("correct"))));
    EXPECT_TRUE(slip.echoes());
  }
  OnTerminal right(words);
  right.until("passphrase: ");
  right.type("correct horse\n");
  right.until("again: ");
  right.type("correct horse\n");
  EXPECT_EQ(right.end(), 0) << right.said();
  EXPECT_THAT(right.said(), Not(HasSubstr("correct")));
  std::ofstream(root_ / "words") << "correct horse\n";
  EXPECT_EQ(run({"unseal", place("p.sealed"), place("out"), "--passphrase-file", place("words")})
                .exit_code,
            0);
}

TEST_F(Seal, SignalAtThePrompt_LeavesTheTerminalAsItWas) {
  make_workspace();
  OnTerminal stopped({"seal", workspace().string(), "--passphrase", "--out", place("p.sealed")});
  stopped.until("passphrase: ");
  EXPECT_FALSE(stopped.echoes());
  stopped.type("corr\x03");
  const int status = stopped.end();
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT) << stopped.said();
  EXPECT_TRUE(stopped.echoes());
  EXPECT_FALSE(fs::exists(root_ / "p.sealed"));
}

TEST_F(Seal, TwoRecipients_OpenItAndAThirdDoesNot) {
  make_workspace();
  const std::string one = key("one");
  const std::string two = key("two");
  key("three");
  const ChildResult sealed = seal({"--to", one, "--to", two});
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_THAT(sealed.out, AllOf(HasSubstr("2 recipients"), HasSubstr("P. Doe, research")));
  for (const std::string& name : {std::string("one"), std::string("two")}) {
    const ChildResult opened = unseal(name, "out_" + name);
    ASSERT_EQ(opened.exit_code, 0) << opened.err;
    EXPECT_EQ(digests_in(root_ / ("out_" + name) / "statistics/current"),
              digests_in(stage_folder() / "current"));
    EXPECT_THAT(run({"status", place("out_" + name), "--check", "--digests"}).exit_code, 0);
  }
  const ChildResult refused = unseal("three", "out_three");
  EXPECT_EQ(refused.exit_code, kExitBadData);
  EXPECT_THAT(refused.err, HasSubstr("sealed to others"));
  EXPECT_FALSE(fs::exists(root_ / "out_three"));
}

TEST_F(Seal, SealedFile_LeaksNoNamesAndIsItsOwnersAlone) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  EXPECT_THAT(bytes("p.sealed"), AllOf(Not(HasSubstr("statistics")), Not(HasSubstr("P. Doe")),
                                       Not(HasSubstr("manifest"))));
  for (const char* name : {"one", "p.sealed"}) {
    struct stat status {};
    ASSERT_EQ(stat(place(name).c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600U) << name;
  }
}

TEST_F(Seal, Age_OpensItAndTarUnpacksIt) {
  ATELIER_NEEDS_PROGRAM("age");
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  fs::create_directories(root_ / "by_age");
  const ChildResult opened = run_child(
      {"sh", "-c",
       "age -d -i " + place("one") + " " + place("p.sealed") + " | tar -x -C " + place("by_age")});
  EXPECT_EQ(opened.exit_code, 0) << opened.err;
  EXPECT_EQ(digests_in(root_ / "by_age/statistics/current"),
            digests_in(stage_folder() / "current"));
}

TEST_F(Seal, ChangedOrCutFile_LeavesNothing) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  const std::string good = bytes("p.sealed");
  const std::vector<std::string> before = others({});
  for (const std::size_t at : {std::size_t{30}, good.size() / 2, good.size() - 1}) {
    std::string wrong = good;
    wrong[at] = static_cast<char>(wrong[at] ^ 4);
    std::ofstream(root_ / "p.sealed", std::ios::binary) << wrong;
    EXPECT_EQ(unseal("one", "out").exit_code, kExitBadData) << at;
    std::ofstream(root_ / "p.sealed", std::ios::binary) << good.substr(0, at);
    EXPECT_EQ(unseal("one", "out").exit_code, kExitBadData) << at;
  }
  EXPECT_EQ(others({}), before);
}

TEST_F(Seal, Passphrase_ComesFromAFile) {
  make_workspace();
  std::ofstream(root_ / "words") << "correct horse\n";
  const ChildResult sealed = seal({"--passphrase-file", place("words")});
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_EQ(run({"unseal", place("p.sealed"), place("out"), "--passphrase-file", place("words")})
                .exit_code,
            0);
  std::ofstream(root_ / "words") << "another\n";
  const ChildResult wrong =
      run({"unseal", place("p.sealed"), place("again"), "--passphrase-file", place("words")});
  EXPECT_EQ(wrong.exit_code, kExitBadData);
  EXPECT_THAT(wrong.err, AllOf(HasSubstr("another passphrase"), Not(HasSubstr("horse"))));
}

TEST_F(Seal, ConsentThatEnded_IsRefused) {
  make_workspace("research", "2020-01-01");
  const ChildResult refused = seal({"--to", key("one")});
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("ended with 2020-01-01"), HasSubstr("renew")));
  EXPECT_FALSE(fs::exists(root_ / "p.sealed"));
}

TEST_F(Seal, PurposeOutsideOfTheScope_IsRefused) {
  make_workspace("internal research");
  const std::string one = key("one");
  const ChildResult refused = seal({"--to", one, "--purpose", "product"});
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err, HasSubstr("does not cover product"));
  EXPECT_EQ(seal({"--to", one, "--purpose", "internal"}).exit_code, 0);
}

TEST_F(Seal, NoConsent_IsSealedOnlyWithAReason) {
  make_workspace("");
  const std::string one = key("one");
  const ChildResult refused = seal({"--to", one});
  EXPECT_EQ(refused.exit_code, kExitUsage);
  EXPECT_THAT(refused.err, HasSubstr("no consent is recorded"));
  EXPECT_EQ(seal({"--to", one, "--consent", "none-needed"}).exit_code, kExitUsage);
  const ChildResult sealed = seal({"--to", one, "--consent", "none-needed", "boxes are nobody"});
  EXPECT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_THAT(sealed.out, HasSubstr("none needed: boxes are nobody"));
}

TEST_F(Seal, OtherFolderAndWrongArguments_AreRefused) {
  make_workspace();
  const std::string one = key("one");
  EXPECT_EQ(run({"seal", input().string(), "--to", one, "--out", place("b")}).exit_code,
            kExitBadData);
  EXPECT_EQ(seal({}).exit_code, kExitUsage);
  EXPECT_EQ(seal({"--to", "age1nobody"}).exit_code, kExitBadData);
  EXPECT_THAT(seal({"--to", place("one")}).err, HasSubstr("goes to --recipients-file"));
  EXPECT_THAT(run({"sign", place("nothing"), "--key", place("one")}).err,
              HasSubstr("nothing there"));
  EXPECT_EQ(
      run({"seal", workspace().string(), "--to", one, "--out", (workspace() / "p.sealed").string()})
          .exit_code,
      kExitUsage);
  EXPECT_EQ(run({"key", "--out", place("one")}).exit_code, kExitUsage) << "a key is not replaced";
}

TEST_F(Seal, SealedWorkspace_IsExportedWithoutBeingUnsealed) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  ASSERT_EQ(run({"export", workspace().string(), place("open")}).exit_code, 0);
  const ChildResult exported =
      run({"export", place("p.sealed"), place("out"), "--identity", place("one")});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_EQ(digests_in(root_ / "out/statistics"), digests_in(root_ / "open/statistics"));
  EXPECT_EQ(run({"export", place("p.sealed"), place("again")}).exit_code, kExitUsage);
  EXPECT_EQ(
      run({"export", workspace().string(), place("again"), "--identity", place("one")}).exit_code,
      kExitUsage);
  key("two");
  EXPECT_EQ(
      run({"export", place("p.sealed"), place("again"), "--identity", place("two")}).exit_code,
      kExitBadData);
  EXPECT_FALSE(fs::exists(root_ / "again"));
}

TEST_F(Seal, SealedWorkspaceWhoseConsentEnded_IsRefused) {
  make_workspace("internal");
  ASSERT_EQ(seal({"--to", key("one"), "--purpose", "internal"}).exit_code, 0);
  const ChildResult refused =
      run({"export", place("p.sealed"), place("out"), "--identity", place("one")});
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err, HasSubstr("does not cover research"));
  EXPECT_EQ(run({"verify", place("p.sealed"), "--identity", place("one")}).exit_code,
            kExitCheckFailed);
}

TEST_F(Seal, Verify_SaysWhatAFileIs) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  const ChildResult closed = run({"verify", place("p.sealed")});
  EXPECT_EQ(closed.exit_code, 0) << closed.err;
  EXPECT_THAT(closed.out, AllOf(HasSubstr("to 1 recipient"), Not(HasSubstr("P. Doe"))));
  const ChildResult open = run({"verify", place("p.sealed"), "--identity", place("one")});
  EXPECT_EQ(open.exit_code, 0) << open.err;
  EXPECT_THAT(open.out, AllOf(HasSubstr("whole; workspace"), HasSubstr("P. Doe, research"),
                              HasSubstr("research: covered")));
  EXPECT_LE(std::count(open.out.begin(), open.out.end(), '\n'), 5);
  const std::string good = bytes("p.sealed");
  std::ofstream(root_ / "p.sealed", std::ios::binary) << good.substr(0, good.size() - 1);
  EXPECT_EQ(run({"verify", place("p.sealed"), "--identity", place("one")}).exit_code, kExitBadData);
}

TEST_F(Seal, SignedConsent_IsCarriedAndRefusedOnceChanged) {
  make_workspace("research");
  const ChildResult made = run({"key", "--signing", "--out", place("signer")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string signer = made.out.substr(0, made.out.find('\n'));
  const ChildResult signed_now = run({"sign", input().string(), "--key", place("signer")});
  ASSERT_EQ(signed_now.exit_code, 0) << signed_now.err;
  EXPECT_THAT(run({"status", workspace().string()}).out, HasSubstr("consent-changed"));
  ASSERT_EQ(run_child(statistics()).exit_code, 0);
  EXPECT_THAT(run({"status", workspace().string()}).out,
              AllOf(HasSubstr("signed by " + signer), Not(HasSubstr("consent-changed"))));
  const std::string one = key("one");
  ASSERT_EQ(seal({"--to", one}).exit_code, 0);
  EXPECT_THAT(run({"verify", place("p.sealed"), "--identity", place("one")}).out,
              HasSubstr("signed by " + signer));
  std::string text = bytes("consent.toml");
  text.replace(text.find("2999"), 4, "3999");
  std::ofstream(root_ / "consent.toml") << text;
  fs::remove(root_ / "p.sealed");
  const ChildResult refused = seal({"--to", one});
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err, HasSubstr("is signed wrongly"));
}

TEST_F(Seal, ConsentInTheCurrentFolder_IsFound) {
  make_workspace();
  const auto here = [&](const std::string& words) {
    return run_child(
        {"bash", "-c",
         "cd " + root_.path().string() + " && exec " + std::string(program_path()) + " " + words});
  };
  for (const std::string& input : {std::string("consent.toml"), input().filename().string()}) {
    EXPECT_THAT(here("verify " + input).out, HasSubstr("P. Doe, research")) << input;
  }
  ASSERT_EQ(run({"key", "--signing", "--out", place("signer")}).exit_code, 0);
  const ChildResult done = here("sign " + input().filename().string() + " --key signer");
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

TEST_F(Seal, FileThatIsNoWorkspace_IsSaidToBeNone) {
  make_workspace();
  key("one");
  std::ofstream(root_ / "cut.sealed") << "age-encr";
  for (const char* name : {"cut.sealed", "nothing"}) {
    const ChildResult refused =
        run({"export", place(name), place("out"), "--identity", place("one")});
    EXPECT_EQ(refused.exit_code, kExitBadData);
    EXPECT_THAT(refused.err, HasSubstr("neither a folder nor a sealed file"));
  }
}

TEST_F(Seal, CommandsThatReadNoSealedFile_SayHowItIsOpened) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  const std::string advice =
      "atelier unseal " + place("p.sealed") + " FOLDER --identity KEY opens it";
  for (const char* command : {"status", "gc"}) {
    const ChildResult refused = run({command, place("p.sealed")});
    EXPECT_EQ(refused.exit_code, kExitBadData);
    EXPECT_THAT(refused.err, AllOf(HasSubstr("a sealed file"), HasSubstr(advice))) << command;
  }
  const ChildResult inspected = run({"inspect", place("p.sealed")});
  EXPECT_EQ(inspected.exit_code, kExitBadData);
  EXPECT_THAT(inspected.err, AllOf(HasSubstr("a sealed file"), HasSubstr(advice)));
  const ChildResult stage = run({"statistics", input().string(), place("p.sealed")});
  EXPECT_EQ(stage.exit_code, kExitUsage);
  EXPECT_THAT(stage.err, AllOf(HasSubstr("it is sealed"), HasSubstr(advice)));
}

TEST_F(Seal, KeyOfTheOtherKind_IsNamed) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  std::ofstream(root_ / "words") << "correct horse\n";
  const ChildResult words =
      run({"unseal", place("p.sealed"), place("out"), "--passphrase-file", place("words")});
  EXPECT_EQ(words.exit_code, kExitBadData);
  EXPECT_THAT(words.err, HasSubstr("sealed to keys, not by a passphrase"));
  for (const char* wrong : {"boxes", "gone", "words", "p.sealed"}) {
    const ChildResult refused = unseal(wrong, "out");
    EXPECT_EQ(refused.exit_code, kExitBadData);
    EXPECT_THAT(refused.err, AllOf(HasSubstr(place(wrong)), Not(HasSubstr("horse")))) << wrong;
  }
  EXPECT_FALSE(fs::exists(root_ / "out"));
}

TEST_F(Seal, RevokedConsent_IsRefused) {
  make_workspace();
  const std::string told = run({"verify", workspace().string()}).out;
  const std::string id = told.substr(told.find("consent: ") + 9, 16);
  std::ofstream(root_ / "revoked.txt") << id << " P. Doe\n";
  const ChildResult refused = seal({"--to", key("one"), "--revoked", place("revoked.txt")});
  EXPECT_EQ(refused.exit_code, kExitCheckFailed);
  EXPECT_THAT(refused.err, HasSubstr("was revoked"));
}

TEST_F(Seal, Log_SaysWhoDidWhat) {
  make_workspace();
  const std::string one = key("one");
  ASSERT_EQ(run({"export", workspace().string(), place("files")}).exit_code, 0);
  ASSERT_EQ(seal({"--to", one}).exit_code, 0);
  const ChildResult log = run({"verify", "--log", workspace().string()});
  EXPECT_EQ(log.exit_code, 0) << log.err;
  EXPECT_THAT(log.out, AllOf(HasSubstr("export"), HasSubstr("files, for research"), HasSubstr(one),
                             HasSubstr("unbroken: 2 lines")));
  const std::string head = log.out.substr(log.out.find("head ") + 5, 64);
  EXPECT_EQ(run({"verify", "--log", workspace().string(), "--head", head}).exit_code, 0);
  std::string text = bytes("work/access.log");
  std::ofstream(workspace() / "access.log") << text.substr(0, text.find('\n') + 1);
  EXPECT_EQ(run({"verify", "--log", workspace().string(), "--head", head}).exit_code,
            kExitCheckFailed);
  std::ofstream(workspace() / "access.log") << text.substr(text.find('\n') + 1);
  EXPECT_EQ(run({"verify", "--log", workspace().string()}).exit_code, kExitBadData);
}

TEST_F(Seal, UsesOfASealedFile_AreLoggedBesideIt) {
  make_workspace();
  const std::string one = key("one");
  ASSERT_EQ(seal({"--to", one}).exit_code, 0);
  EXPECT_EQ(run({"verify", "--log", place("p.sealed")}).exit_code, kExitBadData) << "none yet";
  ASSERT_EQ(
      run({"export", place("p.sealed"), place("files"), "--identity", place("one")}).exit_code, 0);
  ASSERT_EQ(unseal("one", "open").exit_code, 0);
  const std::string file = bytes("p.sealed");
  const std::size_t mac = file.find("\n--- ") + 1;
  const std::string digest = hex(sha256(file.substr(0, file.find('\n', mac) + 1)));
  const ChildResult log = run({"verify", "--log", place("p.sealed")});
  EXPECT_EQ(log.exit_code, 0) << log.err;
  EXPECT_THAT(log.out, AllOf(HasSubstr("open  by " + one + "; header " + digest),
                             HasSubstr("files, for research; header " + digest),
                             HasSubstr("unseal"), HasSubstr("unbroken: 3 lines")));
  EXPECT_THAT(log.out, Not(HasSubstr("P. Doe"))) << "whom it shows is sealed";
  const std::string head = log.out.substr(log.out.find("head ") + 5, 64);
  EXPECT_EQ(run({"verify", "--log", place("p.sealed"), "--head", head}).exit_code, 0);
  const std::string text = bytes("p.sealed.log");
  std::ofstream(root_ / "p.sealed.log") << text.substr(text.find('\n') + 1);
  EXPECT_EQ(run({"verify", "--log", place("p.sealed")}).exit_code, kExitBadData);
  struct stat status {};
  ASSERT_EQ(stat(place("p.sealed.log").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
}

TEST_F(Seal, LogThatCannotLieBesideTheFile_LiesWithItsUser) {
  make_workspace();
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  const auto exported = [&](const std::string& out) {
    return run_child({"env", "XDG_STATE_HOME=" + place("state"), program_path(), "export",
                      place("p.sealed"), place(out), "--identity", place("one")});
  };
  const auto log = [&] {
    return run_child({"env", "XDG_STATE_HOME=" + place("state"), program_path(), "verify", "--log",
                      place("p.sealed")});
  };
  fs::create_directories(root_ / "p.sealed.log");
  const ChildResult first = exported("a");
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.err, Not(HasSubstr("the log was not written")));
  EXPECT_THAT(log().out, HasSubstr("unbroken: 2 lines"));
  fs::remove(root_ / "p.sealed.log");
  std::ofstream(root_ / "p.sealed.log") << "somebody's notes";
  EXPECT_EQ(exported("b").exit_code, 0);
  EXPECT_EQ(bytes("p.sealed.log"), "somebody's notes");
  fs::remove(root_ / "p.sealed.log");
  EXPECT_EQ(exported("c").exit_code, 0);
  const ChildResult both = log();
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_THAT(both.out, AllOf(HasSubstr("unbroken: 2 lines"), HasSubstr("unbroken: 4 lines")));
}

TEST_F(Seal, FullDisk_LeavesNothing) {
  make_workspace();
  const std::string one = key("one");
  ASSERT_EQ(seal({"--to", one}).exit_code, 0);
  const std::vector<std::string> before = others({});
  // Files of at most 1 KiB: every larger one fails as on a full disk.
  const auto limited = [&](const std::string& command) {
    return run_child(
        {"bash", "-c", "ulimit -f 1; exec " + std::string(program_path()) + " " + command});
  };
  EXPECT_EQ(
      limited("unseal " + place("p.sealed") + " " + place("out") + " --identity " + place("one"))
          .exit_code,
      kExitEnvironment);
  EXPECT_EQ(limited("seal " + workspace().string() + " --to " + one + " --out " + place("q.sealed"))
                .exit_code,
            kExitEnvironment);
  EXPECT_EQ(others({}), before);
}

TEST_F(Seal, KilledCommand_LeavesNoPlainData) {
  const std::string name = "Z. Nobody-" + std::to_string(getpid());
  std::ofstream(root_ / "consent.toml")
      << "[consent]\nwho = '" << name << "'\nscope = 'research'\n";
  ASSERT_EQ(run_child(statistics()).exit_code, 0);
  ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
  fs::remove_all(workspace());
  fs::remove(root_ / "consent.toml");
  const fs::path out = root_ / "out";
  const fs::path temporary = fs::temp_directory_path();
  ASSERT_THAT(places_with(name, temporary), ::testing::IsEmpty());
  for (int i = 0; i < 20; ++i) {
    ChildProcess child(
        atelier({"export", place("p.sealed"), out.string(), "--identity", place("one")}));
    usleep(static_cast<useconds_t>(i * 15'000));
    child.kill(SIGKILL);
    child.wait();
    fs::remove_all(out);  // what was asked for may be there
    EXPECT_THAT(places_with(name, temporary), ::testing::IsEmpty()) << i;
    EXPECT_THAT(places_with(name, "/dev/shm"), ::testing::IsEmpty()) << i;
  }
}

/// A simulation, which `view` serves until it is ended.
class SealedView : public Simulate {};

TEST_F(SealedView, ProcessThatHasOpened_MayWriteNoCoreDump) {
  const std::string work = (root_ / "work").string();
  const std::string identity = (root_ / "one").string();
  const std::string sealed = (root_ / "p.sealed").string();
  ASSERT_EQ(stage("work").exit_code, 0);
  const ChildResult made = run({"key", "--out", identity});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string recipient = made.out.substr(0, made.out.find('\n'));
  const ChildResult closed = run(
      {"seal", work, "--to", recipient, "--consent", "none-needed", "made up", "--out", sealed});
  ASSERT_EQ(closed.exit_code, 0) << closed.err;
  const ChildProcess child({program_path(), "view", sealed, "--identity", identity});
  for (int i = 0; i < 1000 && !child.catches(SIGTERM) && !child.has_ended(); ++i) {
    usleep(10'000);  // until it has opened the file, and serves it
  }
  ASSERT_FALSE(child.has_ended());
  std::ifstream file("/proc/" + std::to_string(child.pid()) + "/limits");
  const std::string limits(std::istreambuf_iterator<char>(file), {});
  const std::size_t at = limits.find("Max core file size");
  ASSERT_NE(at, std::string::npos);
  std::istringstream row(limits.substr(at + 18, limits.find('\n', at) - at - 18));
  std::string soft;
  std::string hard;
  row >> soft >> hard;
  EXPECT_EQ(soft, "0");
  EXPECT_EQ(hard, "0");
}

TEST_F(Seal, Export_IsSealedWithItsConsent) {
  make_workspace();
  ASSERT_EQ(run({"export", workspace().string(), place("files")}).exit_code, 0);
  const ChildResult sealed =
      run({"seal", place("files"), "--to", key("one"), "--out", place("p.sealed")});
  ASSERT_EQ(sealed.exit_code, 0) << sealed.err;
  EXPECT_THAT(sealed.out, HasSubstr("P. Doe, research"));
  EXPECT_EQ(unseal("one", "out").exit_code, 0);
}

}  // namespace
}  // namespace atelier::fixtures
