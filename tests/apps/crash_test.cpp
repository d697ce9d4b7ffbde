// Whatever ends a run, wherever: the next one completes to the same digests.

#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/random.h"
#include "tests/apps/statistics_fixture.h"
#include "tests/apps/system_calls.h"

namespace atelier::fixtures {
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
  /// Where the stage on the boxes works.
  std::filesystem::path staging_folder() const {
    const auto plan = nlohmann::json::parse(run_child(statistics({"--dry-run", "--json"})).out);
    const std::filesystem::path result = plan["result"].get<std::string>();
    return result.parent_path() / (".staging-" + result.filename().string());
  }
};

std::filesystem::path file_of_frame(const std::filesystem::path& staging, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.json", frame);
  return staging / "frames" / name;
}

TEST_F(Crash, KilledAtEveryDiskCall_RecoversTheSameResult) {
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

TEST_F(Crash, KilledAtEveryReplacingCall_KeepsTheOldResult) {
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

TEST_F(Crash, Kill_CostsAtMostTheFrameInWork) {
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

/// Waits until a file is there. False if the child ended before.
bool reaches(const ChildProcess& child, const std::filesystem::path& file) {
  while (!std::filesystem::exists(file)) {
    if (child.has_ended()) {
      return std::filesystem::exists(file);
    }
    std::this_thread::yield();
  }
  return true;
}

/// A moment of a run: once one of its files is there, and a count later, which takes from nothing
/// to about the time of a frame.
struct Moment {
  std::filesystem::path file;
  std::uint64_t count = 0;
};

// Which frame a kill comes after, and how long after, is random; that it comes within the work is
// no matter of time: it is sent once the frame is there, and counts if the run has not committed.
// One that came too late (the machine was busy elsewhere) is tried again at the same moment.
TEST_F(Crash, KilledAtRandomTimes_RecoversTheSameResult) {
  const bool soak = injection_stride(0) == 1;
  const int frames = soak ? 40 : 12;
  const int trials = soak ? 500 : 60;  // each ends in a run that completes
  constexpr std::uint64_t kMaxCount = 500'000;
  write_boxes(input(), frames);
  const auto expected = undisturbed();
  ASSERT_EQ(expected.size(), static_cast<std::size_t>(frames) + 1);
  const std::filesystem::path staging = staging_folder();
  Random random{11, 0, 0};
  int attempts = 0;
  int too_late = 0;
  // Kills the run at the moment. False if it had committed, or had ended, before.
  const auto kill_at = [&](const Moment& moment) {
    ++attempts;
    ChildProcess child(statistics({"--jobs", attempts % 2 == 0 ? "1" : "4"}));
    const bool reached = reaches(child, moment.file);
    for (volatile std::uint64_t i = 0; i < moment.count;) {
      i = i + 1;
    }
    child.kill(SIGKILL);
    const bool killed = child.wait().signal == SIGKILL;
    return reached && killed && !std::filesystem::exists(stage_folder() / "current");
  };
  const int wanted = soak ? trials : 100;  // a trial has one at least, and two in the mean
  int kills = 0;
  int completions = 0;
  for (int trial = 0; trial < trials || kills < wanted; ++trial) {
    SCOPED_TRACE(trial);
    // After frame -1: once the run has the lock, before its first frame.
    int frame = static_cast<int>(uniform_index(random, static_cast<std::uint64_t>(frames) + 1)) - 1;
    // Two of three trials kill the run that goes on, too, once or twice, at later frames.
    for (int kill = 0; kill <= trial % 3 && frame < frames; ++kill) {
      const Moment moment{frame < 0 ? stage_folder() / ".lock" : file_of_frame(staging, frame),
                          uniform_index(random, kMaxCount)};
      while (!kill_at(moment)) {
        ++too_late;
        ASSERT_LT(too_late, 20 * trials) << "no kill came within the work";
        // The result that was committed is whole, and the moment is tried anew.
        ASSERT_EQ(result_digests(), expected);
        ASSERT_TRUE(is_clean());
        forget_workspace();
      }
      ++kills;
      while (frame < frames &&
             (frame < 0 || std::filesystem::exists(file_of_frame(staging, frame)))) {
        ++frame;
      }
    }
    const ChildResult next = run_child(statistics());
    ASSERT_EQ(next.exit_code, 0) << next.err;
    ASSERT_EQ(result_digests(), expected);
    ASSERT_TRUE(is_clean());
    ++completions;
    forget_workspace();
  }
  RecordProperty("kills_in_work", kills);
  RecordProperty("completions", completions);
  RecordProperty("kills_too_late", too_late);
  EXPECT_GE(kills, wanted);
}

TEST_F(Crash, LockOfAKilledHolder_IsFree) {
  write_boxes(input(), 200);
  ChildProcess holder(statistics({"--jobs", "1"}));
  ASSERT_TRUE(reaches(holder, stage_folder() / ".lock"));
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

TEST_F(Crash, SignalWhileHashingALargeInput_EndsTheRun) {
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

TEST_F(Crash, TerminationSignal_LeavesCleanStaging) {
  for (const int signal : {SIGTERM, SIGINT}) {
    write_boxes(input(), 150);
    forget_workspace();
    const std::filesystem::path second = file_of_frame(staging_folder(), 1);
    ChildProcess child(statistics({"--jobs", "1", "--json"}));
    ASSERT_TRUE(reaches(child, second));
    child.kill(signal);
    const ChildResult result = child.wait();
    if (result.exit_code == 0) {
      continue;  // it was quicker
    }
    EXPECT_EQ(result.signal, signal);
    const auto end =
        nlohmann::json::parse(result.out.substr(result.out.rfind('\n', result.out.size() - 2) + 1));
    EXPECT_EQ(end["end"], "stopped");
    const int kept = end["frames_kept"];
    EXPECT_GE(kept, 2);
    EXPECT_EQ(end["frames_done"], kept);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(stage_folder())) {
      EXPECT_FALSE(is_temporary_name(entry.path().filename().string())) << entry.path();
    }
    const ChildResult next = run_child(statistics());
    EXPECT_EQ(next.exit_code, 0) << next.err;
    EXPECT_THAT(next.err, HasSubstr(std::to_string(kept) + " of 150 frames are done already"));
    EXPECT_TRUE(is_clean());
  }
}

TEST_F(Crash, TerminationSignal_ReportsTheFramesKept) {
  write_boxes(input(), 150);
  const std::filesystem::path second = file_of_frame(staging_folder(), 1);
  ChildProcess child(statistics({"--jobs", "1"}));
  ASSERT_TRUE(reaches(child, second));
  child.kill(SIGINT);
  const ChildResult result = child.wait();
  if (result.exit_code != 0) {  // else it was quicker
    EXPECT_THAT(result.out, ::testing::ContainsRegex("stopped: [0-9]+ of 150 frames are finished "
                                                     "and kept; the same command goes on"));
  }
}

TEST_F(Crash, StoppedRunWithForce_SaysHowToContinue) {
  write_boxes(input(), 150);
  const auto stopped = [&] {
    const std::filesystem::path second = file_of_frame(staging_folder(), 1);
    ChildProcess child(statistics({"--jobs", "1", "--force"}));
    EXPECT_TRUE(reaches(child, second));
    child.kill(SIGINT);
    return child.wait();
  };
  const ChildResult first = stopped();
  if (first.exit_code != 0) {  // else it was quicker
    EXPECT_THAT(first.out, HasSubstr("kept; the same command without --force goes on from there"));
  }
  ASSERT_EQ(run_child(statistics()).exit_code, 0);
  const ChildResult again = stopped();
  if (again.exit_code != 0) {
    EXPECT_THAT(again.out, HasSubstr("kept; the older result stays; --force starts over, and with "
                                     "--frames of the others goes on from there"));
  }
}

}  // namespace
}  // namespace atelier::fixtures
