// Whatever ends a run, wherever: the next one completes to the same digests.

#include <chrono>
#include <cmath>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/random.h"
#include "tests/apps/statistics_fixture.h"
#include "tests/apps/system_calls.h"

namespace atelier::testing {
namespace {

using ::testing::HasSubstr;

class Crash : public StatisticsFixture {
 protected:
  /// The digests of a run that nothing disturbs.
  std::map<std::string, std::string> undisturbed(const std::vector<std::string>& more = {}) {
    const ChildResult result = run_child(statistics(more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    auto digests = result_digests();
    forget_workspace();
    return digests;
  }
};

TEST_F(Crash, KilledAtEveryCallThatChangesTheDisk) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  write_boxes(input(), 3);
  const std::vector<std::string> command = statistics({"--jobs", "1"});
  const auto expected = undisturbed();
  ASSERT_EQ(expected.size(), 4u);
  const std::vector<SystemCall> calls =
      record_calls(command, {"write", "pwrite64", "fsync", "rename", "renameat2", "close", "mkdir",
                             "unlink", "symlink", "openat"});
  ASSERT_GT(calls.size(), 60u);
  const int stride = injection_stride(3);
  int kills = 0;
  for (std::size_t i = 0; i < calls.size(); i += static_cast<std::size_t>(stride)) {
    SCOPED_TRACE(calls[i].name + " " + std::to_string(calls[i].number));
    forget_workspace();
    // A call at the very end may come one earlier or later: then the run was complete.
    kills += run_child(injected(command, calls[i], "signal=KILL")).signal == SIGKILL ? 1 : 0;
    const ChildResult next = run_child(command);
    ASSERT_EQ(next.exit_code, 0) << next.err;
    ASSERT_EQ(result_digests(), expected);
    ASSERT_TRUE(is_clean());
  }
  RecordProperty("kill_points", kills);
  EXPECT_GE(kills, static_cast<int>(calls.size()) / stride - 4);
}

TEST_F(Crash, KilledAtEveryCallThatReplacesAResult) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  write_boxes(input(), 2);
  const auto expected = undisturbed();
  const std::vector<std::string> command = statistics({"--jobs", "1", "--force"});
  ASSERT_EQ(run_child(statistics()).exit_code, 0);
  const std::vector<SystemCall> calls = record_calls(
      command, {"fsync", "rename", "renameat2", "mkdir", "unlink", "unlinkat", "symlink"});
  ASSERT_GT(calls.size(), 20u);
  const int stride = injection_stride(2);
  for (std::size_t i = 0; i < calls.size(); i += static_cast<std::size_t>(stride)) {
    SCOPED_TRACE(calls[i].name + " " + std::to_string(calls[i].number));
    run_child(injected(command, calls[i], "signal=KILL"));
    // The older result is intact at any moment: it is found done.
    const ChildResult next = run_child(statistics());
    ASSERT_EQ(next.exit_code, 0) << next.err;
    ASSERT_THAT(next.out, HasSubstr("is done already"));
    ASSERT_EQ(result_digests(), expected);
  }
}

TEST_F(Crash, AKillCostsNoMoreThanTheFrameInWork) {
  if (!can_inject()) {
    GTEST_SKIP() << "strace cannot trace here";
  }
  write_boxes(input(), 6);
  const std::vector<std::string> command = statistics({"--jobs", "1"});
  const std::vector<SystemCall> calls = record_calls(command, {"rename"});
  ASSERT_GE(calls.size(), 6u);
  // Right before frame 4's rename: frames 0 to 3 are kept.
  forget_workspace();
  run_child(injected(command, calls[4], "signal=KILL"));
  const ChildResult next = run_child(command);
  EXPECT_EQ(next.exit_code, 0) << next.err;
  EXPECT_THAT(next.err, HasSubstr("4 of 6 frames are done already"));
}

TEST_F(Crash, KilledAtRandomTimes) {
  write_boxes(input(), 40);
  const auto begin = std::chrono::steady_clock::now();
  const auto expected = undisturbed();
  const double whole_run =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  // Only kills that come before the run's own end count, and all of them have to: the delays are
  // spread over orders of magnitude below the time of a whole run, so that a machine that is now
  // faster or slower than it was a moment ago only needs more attempts.
  constexpr double kOctaves = 6;
  const int trials = injection_stride(0) == 1 ? 500 : 100;
  Random random{11, 0, 0};
  int landed = 0;
  int attempts = 0;
  int in_work = 0;  // of the landed: with the workspace begun
  while (landed < trials && attempts < 20 * trials) {
    SCOPED_TRACE(attempts);
    const std::chrono::duration<double> delay(whole_run * std::exp2(-kOctaves * uniform(random)));
    ChildProcess child(statistics({"--jobs", attempts % 2 == 0 ? "1" : "4"}));
    std::this_thread::sleep_for(delay);
    child.kill(SIGKILL);
    const bool killed = child.wait().signal == SIGKILL;
    ++attempts;
    landed += killed ? 1 : 0;
    in_work += killed && std::filesystem::exists(stage_folder() / ".lock") ? 1 : 0;
    // A killed run's result is either not there or whole; every few kills the work is brought to
    // its end, so that kills hit every part of it.
    if (killed && landed % 10 == 0) {
      const ChildResult next = run_child(statistics());
      ASSERT_EQ(next.exit_code, 0) << next.err;
      ASSERT_EQ(result_digests(), expected);
      ASSERT_TRUE(is_clean());
      forget_workspace();
    } else if (std::filesystem::exists(stage_folder() / "current")) {
      ASSERT_EQ(result_digests(), expected);
      forget_workspace();  // nothing is left to kill
    }
  }
  RecordProperty("kills", landed);
  RecordProperty("attempts", attempts);
  RecordProperty("kills_in_work", in_work);
  EXPECT_EQ(landed, trials) << "of " << attempts << " attempts";
}

TEST_F(Crash, AKilledHoldersLockIsFree) {
  write_boxes(input(), 200);
  ChildProcess holder(statistics({"--jobs", "1"}));
  while (!std::filesystem::exists(stage_folder() / ".lock")) {
    std::this_thread::yield();
  }
  holder.kill(SIGKILL);
  holder.wait();
  EXPECT_EQ(run_child(statistics()).exit_code, 0);
}

/// True once the process has the file open.
bool has_open(pid_t pid, const std::filesystem::path& file) {
  std::error_code error;
  auto walk = std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd", error);
  while (!error && walk != std::filesystem::directory_iterator()) {
    std::error_code gone;
    if (std::filesystem::read_symlink(walk->path(), gone) == file) {
      return true;
    }
    walk.increment(error);
  }
  return false;
}

TEST_F(Crash, ASignalEndsTheDigestingOfALargeInput) {
  write_boxes(input(), 1);
  const std::filesystem::path large = std::filesystem::canonical(input()) / "large.bin";
  std::ofstream(large) << "x";
  std::error_code error;
  std::filesystem::resize_file(large, 300'000'000'000, error);  // minutes of digesting
  if (error) {
    GTEST_SKIP() << "no sparse file of 300 GB here: " << error.message();
  }
  for (const int signal : {SIGTERM, SIGINT}) {
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{}, std::vector<std::string>{"--dry-run"}}) {
      ChildProcess child(statistics(more));
      while (!has_open(child.pid(), large)) {
        std::this_thread::yield();
      }
      child.kill(signal);
      const ChildResult result = child.wait();
      EXPECT_EQ(result.signal, signal) << result.err;
      EXPECT_FALSE(std::filesystem::exists(workspace()));
      if (more.empty()) {
        EXPECT_THAT(result.out, HasSubstr("stopped before its work began; nothing was changed"));
      }
    }
  }
}

TEST_F(Crash, SignalsToEndLeaveACleanStaging) {
  for (const int signal : {SIGTERM, SIGINT}) {
    write_boxes(input(), 150);
    forget_workspace();
    ChildProcess child(statistics({"--jobs", "1"}));
    while (!std::filesystem::exists(stage_folder() / ".lock")) {
      std::this_thread::yield();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    child.kill(signal);
    const ChildResult result = child.wait();
    if (result.exit_code == 0) {
      continue;  // it was quicker
    }
    EXPECT_EQ(result.signal, signal);
    EXPECT_THAT(result.out, HasSubstr("frames are kept"));
    for (const auto& entry : std::filesystem::recursive_directory_iterator(stage_folder())) {
      EXPECT_FALSE(is_temporary_name(entry.path().filename().string())) << entry.path();
    }
    const ChildResult next = run_child(statistics());
    EXPECT_EQ(next.exit_code, 0) << next.err;
    EXPECT_THAT(next.err, HasSubstr("frames are done already"));
    EXPECT_TRUE(is_clean());
  }
}

}  // namespace
}  // namespace atelier::testing
