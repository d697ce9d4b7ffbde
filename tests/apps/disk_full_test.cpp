// A full or failing disk: exit code 5, a sentence with the path, older results intact, and the next
// run completes.

#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "tests/apps/statistics_fixture.h"
#include "tests/apps/system_calls.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class DiskFull : public StatisticsFixture {
 protected:
  void SetUp() override { write_boxes(input(), 3); }

  /// What a run may do about a call that failed.
  enum class Then { Fails, FailsOrIsWhole };

  /// Every error a call can give, injected at every such call of a run (or a sample of them).
  void every_call(const std::vector<std::string>& names, const std::string& error, int sampled,
                  Then then = Then::Fails) {
    if (!can_inject()) {
      GTEST_SKIP() << "strace cannot trace here";
    }
    const std::vector<std::string> command = statistics({"--jobs", "1"});
    ASSERT_EQ(run_child(command).exit_code, 0);
    const auto expected = result_digests();
    // An older result of another key, which has to survive.
    const std::vector<std::string> other =
        statistics({"--jobs", "1", "--statistics.edge_quantiles", "0.5"});
    ASSERT_EQ(run_child(other).exit_code, 0);
    const auto other_expected = result_digests();
    const std::filesystem::path other_result =
        std::filesystem::canonical(stage_folder() / "current");
    ASSERT_NE(other_expected, expected);
    const auto start_over = [&] {
      for (const auto& entry : std::filesystem::directory_iterator(stage_folder())) {
        if (entry.is_directory() && !entry.is_symlink() && entry.path() != other_result) {
          std::filesystem::remove_all(entry.path());
        }
      }
      std::filesystem::remove(stage_folder() / "current");
      std::filesystem::create_symlink(other_result.filename(), stage_folder() / "current");
    };
    // Recorded as the injected runs are: with the older result there, current and done.
    start_over();
    ASSERT_THAT(run_child(other).out, HasSubstr("is done already"));
    std::vector<std::string> more = names;
    more.push_back("mkdir");
    const std::vector<SystemCall> calls = record_calls(command, more);
    const auto stride = static_cast<std::size_t>(injection_stride(sampled));
    int injections = 0;
    int failures = 0;
    for (std::size_t i = 0; i < calls.size(); i += stride) {
      if (std::find(names.begin(), names.end(), calls[i].name) == names.end()) {
        continue;
      }
      SCOPED_TRACE(calls[i].name + " " + std::to_string(calls[i].number));
      start_over();
      ++injections;
      const ChildResult failed = run_child(injected(command, calls[i], "error=" + error));
      if (failed.exit_code != 0) {
        ++failures;
        EXPECT_EQ(failed.exit_code, 5) << failed.err;
        EXPECT_THAT(failed.err, HasSubstr("atelier: "));
        // Writes to the terminal fail too; all others name a path of the workspace.
        if (failed.err.find("standard output") == std::string::npos) {
          EXPECT_THAT(failed.err, HasSubstr(workspace().string()));
        }
        EXPECT_THAT(failed.err, HasSubstr(error == "EIO" ? "Input/output error; the disk"
                                                         : "No space left on device; free space"));
        EXPECT_EQ(result_digests(), calls[i].after_swap ? expected : other_expected)
            << "what current leads to is whole";
      } else {
        EXPECT_EQ(then, Then::FailsOrIsWhole) << "the failure was ignored";
        ASSERT_EQ(result_digests(), expected) << "it says that it is done";
        ASSERT_TRUE(is_clean());
      }
      EXPECT_EQ(digests_in(other_result), other_expected) << "the older result has its bytes";
      const ChildResult next = run_child(command);
      ASSERT_EQ(next.exit_code, 0) << next.err;
      ASSERT_EQ(result_digests(), expected);
      ASSERT_TRUE(is_clean());
    }
    EXPECT_GT(failures, 0);
    RecordProperty("injected", injections);
    RecordProperty("failed", failures);
  }
};

TEST_F(DiskFull, NoSpaceAtEveryWrite_FailsCleanlyOrCompletes) {
  // Lines of progress go nowhere where standard error takes none.
  every_call({"write", "pwrite64"}, "ENOSPC", 1, Then::FailsOrIsWhole);
}

TEST_F(DiskFull, NoSpaceAtEverySync_FailsCleanly) {
  every_call({"fsync"}, "ENOSPC", 2);
}

TEST_F(DiskFull, BrokenDiskAtEverySync_FailsCleanly) {
  every_call({"fsync"}, "EIO", 3);
}

TEST_F(DiskFull, BrokenDiskAtEveryRename_FailsCleanly) {
  every_call({"rename", "symlink"}, "EIO", 1);
}

TEST_F(DiskFull, BrokenDiskAtEveryWrite_FailsCleanlyOrCompletes) {
  every_call({"write", "pwrite64"}, "EIO", 3, Then::FailsOrIsWhole);
}

TEST_F(DiskFull, BrokenDiskAtEveryClose_FailsCleanlyOrCompletes) {
  // Most closes are of files that were read, and may fail.
  every_call({"close"}, "EIO", 2, Then::FailsOrIsWhole);
}

TEST_F(DiskFull, FileSizeLimit_IsAnEnvironmentError) {
  const std::vector<std::string> command = statistics({"--jobs", "1"});
  std::string words;
  for (const std::string& word : command) {
    words += " '" + word + "'";
  }
  // 1 kB: statistics.json is larger.
  const ChildResult result = run_child({"bash", "-c", "ulimit -f 1; exec" + words});
  EXPECT_EQ(result.signal, 0);
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_THAT(result.err, HasSubstr("File too large"));
  EXPECT_EQ(run_child(command).exit_code, 0);
  EXPECT_TRUE(is_clean());
}

TEST_F(DiskFull, NoSpaceForAFolder_FailsCleanly) {
  every_call({"mkdir"}, "ENOSPC", 1);
}

TEST_F(DiskFull, TinyDisk_FailsCleanlyOrCompletes) {
  const std::filesystem::path disk = root_ / "work";
  std::filesystem::create_directories(disk);
  int failed = 0;
  for (const char* size : {"size=16k", "size=24k", "size=32k", "size=48k"}) {
    SCOPED_TRACE(size);
    if (mount("tmpfs", disk.c_str(), "tmpfs", 0, size) != 0) {
      GTEST_SKIP() << "mounting is not allowed here: " << std::strerror(errno);
    }
    const ChildResult result = run_child(statistics({"--jobs", "1"}));
    const bool left = std::filesystem::exists(stage_folder() / "current");
    umount2(disk.c_str(), MNT_DETACH);
    if (result.exit_code != 0) {
      EXPECT_EQ(result.exit_code, 5) << result.err;
      EXPECT_THAT(result.err, HasSubstr(disk.string()));
      EXPECT_THAT(result.err, HasSubstr("No space left on device"));
      EXPECT_FALSE(left);
      ++failed;
    } else {
      EXPECT_TRUE(left);
    }
  }
  EXPECT_GT(failed, 0) << "no disk was too small";
}

TEST_F(DiskFull, TinyDisk_KeepsTheOldResult) {
  const std::filesystem::path disk = root_ / "work";
  std::filesystem::create_directories(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0) {
    GTEST_SKIP() << "mounting is not allowed here: " << std::strerror(errno);
  }
  const ChildResult first = run_child(statistics({"--jobs", "1"}));
  const auto expected = result_digests();
  // Each run wants another result; at some time there is no room for one more.
  int failed = 0;
  for (int i = 0; i < 5; ++i) {
    const ChildResult next = run_child(
        statistics({"--jobs", "1", "--statistics.edge_quantiles", "0." + std::to_string(i)}));
    failed += next.exit_code == 5 ? 1 : 0;
    EXPECT_TRUE(next.exit_code == 0 || next.exit_code == 5) << next.err;
  }
  const ChildResult again = run_child(statistics());
  const auto digests = result_digests();
  umount2(disk.c_str(), MNT_DETACH);
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_GT(failed, 0);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("is done already"));
  EXPECT_EQ(digests, expected);
}

}  // namespace
}  // namespace atelier::fixtures
