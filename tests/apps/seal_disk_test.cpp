// A full disk and a kill at every call that writes: no plain data stays where nobody asked for it.

#include <algorithm>
#include <fstream>

#include <signal.h>
#include <unistd.h>

#include "core/exit_code.h"
#include "tests/apps/seal_fixture.h"
#include "tests/apps/system_calls.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

class SealDisk : public Seal {
 protected:
  /// A workspace of somebody whose name is nowhere else, sealed; its plain files are gone.
  void seal_somebody() {
    name_ = "Z. Nobody-disk-" + std::to_string(getpid());
    std::ofstream(root_ / "consent.toml")
        << "[consent]\nwho = '" << name_ << "'\nscope = 'research'\n";
    ASSERT_EQ(run_child(statistics()).exit_code, 0);
    ASSERT_EQ(seal({"--to", key("one")}).exit_code, 0);
    fs::remove_all(workspace());
    fs::remove(root_ / "consent.toml");
    ASSERT_THAT(places_with(name_, fs::temp_directory_path()), IsEmpty());
  }
  std::vector<std::string> command(const std::string& what) const {
    return atelier({what, place("p.sealed"), place("out"), "--identity", place("one")});
  }
  /// What was asked for goes; nothing of the person is anywhere else.
  void expect_nothing_plain(bool asked_for_stays) const {
    if (asked_for_stays) {
      fs::remove_all(root_ / "out");
      fs::remove_all(root_ / ".out.unfinished");
    }
    for (const fs::path& place : {fs::temp_directory_path(), fs::path("/dev/shm")}) {
      EXPECT_THAT(places_with(name_, place), IsEmpty());
    }
  }
  /// Does one thing at every call, or a sample of them, by which a command changes a disk. Returns
  /// how many of the runs failed.
  int inject(const std::string& what, const std::vector<std::string>& names,
             const std::string& fault, int sampled) {
    const std::vector<SystemCall> calls = record_calls(command(what), names);
    EXPECT_GT(calls.size(), 5U);
    fs::remove_all(root_ / "out");
    const auto stride = static_cast<std::size_t>(injection_stride(sampled));
    int failures = 0;
    for (std::size_t i = 0; i < calls.size(); i += stride) {
      SCOPED_TRACE(calls[i].name + " " + std::to_string(calls[i].number));
      const ChildResult result = run_child(injected(command(what), calls[i], fault));
      failures += result.exit_code != 0 ? 1 : 0;
      expect_nothing_plain(fault.starts_with("signal") || result.exit_code == 0);
    }
    return failures;
  }

  std::string name_;
};

TEST_F(SealDisk, NoSpaceAtEveryWriteOfUnseal_LeavesNothing) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  seal_somebody();
  EXPECT_GT(inject("unseal", {"write", "openat", "mkdir", "symlink", "rename", "syncfs"},
                   "error=ENOSPC", 3),
            3);
}

TEST_F(SealDisk, NoSpaceAtEveryWriteOfAnExport_LeavesNothing) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  seal_somebody();
  EXPECT_GT(inject("export", {"write", "mkdir", "symlink", "rename", "fsync"}, "error=ENOSPC", 5),
            3);
}

TEST_F(SealDisk, KillAtEveryCallOfAnExport_LeavesNothingButWhatWasAskedFor) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  seal_somebody();
  EXPECT_GT(inject("export", {"write", "openat", "mkdir", "symlink", "rename", "close", "mount"},
                   "signal=KILL", 9),
            3);
}

TEST_F(SealDisk, KilledUnseal_LeavesWhatTheNextOneRemoves) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  seal_somebody();
  const std::vector<SystemCall> calls = record_calls(command("unseal"), {"write", "rename"});
  fs::remove_all(root_ / "out");
  const auto stride = static_cast<std::size_t>(injection_stride(3));
  for (std::size_t i = 0; i < calls.size(); i += stride) {
    SCOPED_TRACE(calls[i].name + " " + std::to_string(calls[i].number));
    run_child(injected(command("unseal"), calls[i], "signal=KILL"));
    fs::remove_all(root_ / "out");
    ASSERT_EQ(unseal("one", "out").exit_code, 0);
    EXPECT_FALSE(fs::exists(root_ / ".out.unfinished"));
    fs::remove_all(root_ / "out");
    expect_nothing_plain(false);
  }
}

}  // namespace
}  // namespace atelier::fixtures
