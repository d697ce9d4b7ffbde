#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/store/collect_garbage.h"
#include "core/store/file_lock.h"
#include "core/store/input_digest.h"
#include "core/store/result.h"
#include "core/store/run_stage.h"
#include "core/store/workspace_status.h"
#include "tests/core_store/test_stages.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class GarbageTest : public ::testing::Test {
 protected:
  GarbageTest() {
    behaviour() = {};
    std::filesystem::create_directories(root_ / "in");
    std::ofstream(root_ / "in/a.txt") << "3";
  }
  std::filesystem::path run(const std::string& word) {
    StageRequest what;
    what.input = root_ / "in";
    what.workspace = root_ / "work";
    what.options = kTestStages[0].options();
    EXPECT_EQ(set_option(what.options.table, "word", word), "");
    return run_stage(kTestStages, kTestStages[0], what).plan.result_folder;
  }
  std::vector<Garbage> collect(bool dry_run = false) {
    return collect_garbage(kTestStages, root_ / "work", dry_run);
  }
  std::filesystem::path count() const { return root_ / "work/count"; }

  TemporaryDirectory root_;
};

TEST_F(GarbageTest, CurrentResultOnly_IsNoGarbage) {
  run("a");
  EXPECT_THAT(collect(), IsEmpty());
}

TEST_F(GarbageTest, OlderResults_AreRemovedAndCurrentIsKept) {
  const auto first = run("a");
  const auto second = run("b");
  const auto dry = collect(true);
  ASSERT_EQ(dry.size(), 1u);
  EXPECT_EQ(dry[0].path, first);
  EXPECT_EQ(dry[0].what, "a result that is no longer current");
  EXPECT_GT(dry[0].bytes, 500);
  EXPECT_EQ(dry[0].kept, "");
  EXPECT_FALSE(dry[0].removed);
  EXPECT_TRUE(std::filesystem::exists(first));
  EXPECT_TRUE(collect()[0].removed);
  EXPECT_FALSE(std::filesystem::exists(first));
  EXPECT_TRUE(std::filesystem::exists(second));
}

TEST_F(GarbageTest, UnfinishedWork_IsRemoved) {
  run("a");
  std::filesystem::create_directories(count() / ".staging-0123456789abcdef/frames");
  std::filesystem::create_directories(count() / ".replaced-0123456789abcdef");
  std::ofstream(count() / ".atelier-abcdef.tmp") << "x";
  EXPECT_EQ(collect().size(), 3u);
  EXPECT_THAT(collect(), IsEmpty());
}

TEST_F(GarbageTest, UnknownFiles_AreLeftAlone) {
  run("a");
  std::ofstream(root_ / "work/notes.txt") << "x";
  std::filesystem::create_directories(root_ / "work/other/0123456789abcdef");
  std::ofstream(count() / "notes.txt") << "x";
  std::filesystem::create_directories(count() / "backup");
  EXPECT_THAT(collect(), IsEmpty());
}

TEST_F(GarbageTest, NoCurrentResult_LeavesEverything) {
  const auto first = run("a");
  std::filesystem::remove(count() / "current");
  EXPECT_THAT(collect(), IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(first));
}

TEST_F(GarbageTest, RunningStage_IsLeftAlone) {
  const auto first = run("a");
  run("b");
  const auto lock = FileLock::try_lock(count() / ".lock", FileLock::Mode::Shared);
  for (const bool dry_run : {true, false}) {
    const auto found = collect(dry_run);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].what, "a result that is no longer current");
    EXPECT_EQ(found[0].kept, "the stage is running");
    EXPECT_FALSE(found[0].removed);
  }
  EXPECT_TRUE(std::filesystem::exists(first));
}

TEST_F(GarbageTest, ResultBeingRead_IsLeftAlone) {
  const auto first = run("a");
  run("b");
  const auto lock = FileLock::try_lock_folder(first, FileLock::Mode::Shared);
  EXPECT_EQ(collect(true)[0].kept, "it is being read");
  EXPECT_EQ(collect()[0].kept, "it is being read");
  EXPECT_TRUE(std::filesystem::exists(first));
}

TEST_F(GarbageTest, Links_AreNotFollowed) {
  run("a");
  std::filesystem::create_directories(root_ / "precious");
  std::ofstream(root_ / "precious/x") << "x";
  std::filesystem::create_directory_symlink(root_ / "precious",
                                            count() / ".staging-0123456789abcdef");
  std::filesystem::create_directories(count() / ".staging-1123456789abcdef");
  std::filesystem::create_directory_symlink(root_ / "precious",
                                            count() / ".staging-1123456789abcdef/link");
  collect();
  EXPECT_TRUE(std::filesystem::exists(root_ / "precious/x"));
}

TEST_F(GarbageTest, FoldersThatResembleWork_AreLeftAlone) {
  run("a");
  for (const char* name : {".staging-mine", ".staging-", ".replaced-old",
                           ".staging-0123456789ABCDEF", ".staging-0123456789abcdef0"}) {
    std::filesystem::create_directories(count() / name);
  }
  EXPECT_THAT(collect(), IsEmpty());
  EXPECT_TRUE(std::filesystem::exists(count() / ".staging-mine"));
  EXPECT_THAT(workspace_status(kTestStages, root_ / "work")[0].unfinished, IsEmpty());
}

TEST_F(GarbageTest, OlderResultBesideDamagedOne_IsKept) {
  const auto first = run("a");
  const auto second = run("b");
  for (const char* damage : {"bytes", "size", "manifest", "all"}) {
    SCOPED_TRACE(damage);
    if (std::string(damage) == "bytes") {
      std::ofstream(second / "count.txt") << "9 b";  // as long as "1 b"
    } else if (std::string(damage) == "size") {
      std::ofstream(second / "count.txt") << "10 b";
    } else if (std::string(damage) == "manifest") {
      std::ofstream(second / "manifest.json") << "{";
    } else {
      std::filesystem::remove_all(second);
    }
    EXPECT_THAT(collect(), IsEmpty());
    EXPECT_TRUE(std::filesystem::exists(first / "manifest.json"));
  }
  run("b");
  EXPECT_EQ(collect().size(), 1u) << "a sound one is there again";
}

TEST_F(GarbageTest, FolderWithoutStages_IsRefused) {
  try {
    collect_garbage(kTestStages, root_ / "in", true);
    FAIL() << "it looked for garbage in any folder";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a folder in which no stage has run"));
  }
}

TEST_F(GarbageTest, MissingWorkspaceOrFile_IsRefused) {
  EXPECT_THROW(collect_garbage(kTestStages, root_ / "nothing", true), DataError);
  std::ofstream(root_ / "file") << "x";
  EXPECT_THROW(collect_garbage(kTestStages, root_ / "file", true), DataError);
}

TEST_F(GarbageTest, StageFolderThatIsALink_IsRefused) {
  run("a");
  std::filesystem::rename(count(), root_ / "away");
  std::filesystem::create_directory_symlink(root_ / "away", count());
  EXPECT_THROW(collect(), DataError);
}

TEST_F(GarbageTest, StatusOfNonWorkspace_IsDataError) {
  EXPECT_THROW(workspace_status(kTestStages, root_ / "nothing"), DataError);
  EXPECT_THROW(workspace_status(kTestStages, root_ / "in"), DataError);
}

TEST_F(GarbageTest, StatusWithoutCurrentResult_IsNoneOrUnfinished) {
  std::filesystem::create_directories(count() / "0123456789abcdef");
  std::filesystem::create_directories(root_ / "work/frames/.staging-0123456789abcdef");
  const auto status = workspace_status(kTestStages, root_ / "work");
  EXPECT_EQ(status[0].state, StageStatus::State::None);
  EXPECT_FALSE(status[0].running);
  EXPECT_EQ(status[0].older_results, 0) << "nothing that collect_garbage removes";
  EXPECT_EQ(status_of(status, "frames").state, StageStatus::State::Unfinished);
}

TEST_F(GarbageTest, StatusOfDamagedManifest_IsDamaged) {
  const auto result = run("a");
  std::ofstream(result / "manifest.json") << "{";
  const auto status = workspace_status(kTestStages, root_ / "work");
  EXPECT_EQ(status[0].state, StageStatus::State::Damaged);
  EXPECT_FALSE(status[0].manifest);
  EXPECT_EQ(status[0].findings[0].code, "manifest-damaged");
}

TEST_F(GarbageTest, Status_CountsOlderResults) {
  run("a");
  run("b");
  run("c");
  EXPECT_EQ(workspace_status(kTestStages, root_ / "work")[0].older_results, 2);
}

TEST_F(GarbageTest, Status_ChangesNothing) {
  run("a");
  std::filesystem::remove(count() / ".lock");
  workspace_status(kTestStages, root_ / "work", Check::Digests);
  EXPECT_FALSE(std::filesystem::exists(count() / ".lock"));
}

// --- what status and keys stand on

TEST_F(GarbageTest, InputDigest_DependsOnNamesAndBytes) {
  const Digest before = digest_of_input(root_ / "in").digest;
  EXPECT_EQ(digest_of_input(root_ / "in").digest, before);
  std::filesystem::rename(root_ / "in/a.txt", root_ / "in/b.txt");
  EXPECT_NE(digest_of_input(root_ / "in").digest, before);
  std::filesystem::rename(root_ / "in/b.txt", root_ / "in/a.txt");
  EXPECT_EQ(digest_of_input(root_ / "in").digest, before);
  std::ofstream(root_ / "in/a.txt") << "4";
  EXPECT_NE(digest_of_input(root_ / "in").digest, before);
}

TEST_F(GarbageTest, InputDigest_IncludesConsentOnlyWhereKeyed) {
  const auto digest = [&](ConsentPart part) { return digest_of_input(root_ / "in", {}, part); };
  const InputDigest apart = digest(ConsentPart::Apart);
  const InputDigest keyed = digest(ConsentPart::Keyed);
  EXPECT_EQ(stamp_of_input(root_ / "in", ConsentPart::Keyed), keyed.stamp);
  std::ofstream(root_ / "consent.toml") << "[consent]\nwho = 'P'\nscope = 'research'\n";
  EXPECT_EQ(digest(ConsentPart::Apart).digest, apart.digest);
  EXPECT_EQ(digest(ConsentPart::Apart).stamp, apart.stamp);
  EXPECT_NE(digest(ConsentPart::Keyed).digest, keyed.digest);
  EXPECT_NE(stamp_of_input(root_ / "in", ConsentPart::Keyed), keyed.stamp);
}

TEST(WithoutConsent, ConsentTables_AreTheOnlyTextRemoved) {
  const std::string tables = "[[consent]]\nwho = 'P'\n\n  [ consent ] # theirs\nwho = 'Q'\n\n";
  EXPECT_EQ(without_consent("fps = 3\n\n" + tables + "[camera]\nx = 1\n"),
            "fps = 3\n\n[camera]\nx = 1\n");
  EXPECT_EQ(without_consent("fps = 3\n\n" + tables), "fps = 3\n");
  EXPECT_EQ(without_consent(tables), "");
  for (const char* whole : {"", "fps = 3\n\n", "[consents]\nx = 1\n", "[consent.more]\nx = 1\n",
                            "consent = 1\n", "[x.consent]\ny = 1\n", "x = [\n  [1, 2],\n]\n",
                            "x = \"\"\"\n[consent]\ny\"\"\"\n", "x = '''\n[consent]\ny'''\n",
                            "[consent\nx = 1", "[", "[[", "[]", "[[]]", "[[consent]\nx"}) {
    EXPECT_EQ(without_consent(whole), whole);
  }
}

TEST_F(GarbageTest, InputDigestOfFile_IgnoresItsName) {
  std::ofstream(root_ / "b.txt") << "3";
  EXPECT_EQ(digest_of_input(root_ / "in/a.txt").digest, digest_of_input(root_ / "b.txt").digest);
  EXPECT_NE(digest_of_input(root_ / "in").digest, digest_of_input(root_ / "b.txt").digest);
}

TEST_F(GarbageTest, Digesting_PollsForStop) {
  std::filesystem::resize_file(root_ / "in/a.txt", 8 << 20);
  int asked = 0;
  StageEvents events;
  events.stop = [&] { return ++asked == 3; };
  EXPECT_THROW(digest_of_input(root_ / "in", events), StopRequested);
  EXPECT_EQ(asked, 3) << "once for every MiB";
  asked = 10;
  EXPECT_EQ(digest_of_input(root_ / "in", events).bytes, 8 << 20);
  EXPECT_EQ(asked, 18);
}

TEST_F(GarbageTest, Digesting_ReportsProgress) {
  std::vector<StageProgress> told;
  StageEvents events;
  events.progress = [&](const StageProgress& progress) { told.push_back(progress); };
  DigestMeter meter(events, -1);
  meter.expect(300);
  meter.add(100);
  meter.add(300);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].unit, kDigestUnit);
  EXPECT_EQ(told[0].done, 100);
  EXPECT_EQ(told[0].total, 300);
  EXPECT_GT(told[0].per_second, 0);
  EXPECT_NEAR(told[0].seconds_left, 200 / told[0].per_second, 1e-9);
  EXPECT_EQ(told[1].total, 400) << "a file that grew";
  DigestMeter quiet(events, 1e9);
  quiet.add(1);
  EXPECT_EQ(told.size(), 2u);
}

TEST_F(GarbageTest, InputStamp_ChangesWithModificationTime) {
  const Digest before = stamp_of_input(root_ / "in");
  EXPECT_EQ(stamp_of_input(root_ / "in"), before);
  std::filesystem::last_write_time(
      root_ / "in/a.txt", std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_NE(stamp_of_input(root_ / "in"), before);
  EXPECT_EQ(digest_of_input(root_ / "in").digest, digest_of_input(root_ / "in").digest);
}

TEST_F(GarbageTest, DigestOfLinkOrFolder_IsRefused) {
  std::filesystem::create_symlink(root_ / "in/a.txt", root_ / "link");
  EXPECT_THROW(digest_of_file(root_ / "link"), DataError);
  EXPECT_THROW(digest_of_file(root_ / "in"), DataError);
  EXPECT_THROW(digest_of_file(root_ / "nothing"), DataError);
  EXPECT_THROW(digest_of_file("/dev/null"), DataError);
  EXPECT_EQ(digest_of_file(root_ / "in/a.txt").digest, sha256("3"));
}

TEST_F(GarbageTest, FileLocks_ExcludeAndShare) {
  const auto path = root_ / "lock";
  auto shared = FileLock::try_lock(path, FileLock::Mode::Shared);
  ASSERT_TRUE(shared);
  EXPECT_TRUE(FileLock::try_lock(path, FileLock::Mode::Shared));
  EXPECT_FALSE(FileLock::try_lock(path, FileLock::Mode::Exclusive));
  shared.reset();
  const auto exclusive = FileLock::try_lock(path, FileLock::Mode::Exclusive);
  EXPECT_TRUE(exclusive);
  EXPECT_FALSE(FileLock::try_lock(path, FileLock::Mode::Shared));
}

TEST_F(GarbageTest, LockQuery_DoesNotCreateTheLock) {
  const auto path = root_ / "lock";
  EXPECT_FALSE(FileLock::is_held(path));
  EXPECT_FALSE(std::filesystem::exists(path));
  for (const auto mode : {FileLock::Mode::Shared, FileLock::Mode::Exclusive}) {
    const auto lock = FileLock::try_lock(path, mode);
    EXPECT_TRUE(FileLock::is_held(path));
  }
  EXPECT_FALSE(FileLock::is_held(path));
}

TEST_F(GarbageTest, FrameLocks_ExcludeByFrame) {
  const auto path = root_ / "frames";
  auto first = FrameLock::try_lock(path, {5, 1, 2, 3});
  ASSERT_TRUE(first);
  EXPECT_FALSE(FrameLock::try_lock(path, {3}));
  EXPECT_FALSE(FrameLock::try_lock(path, {4, 5}));
  {
    const auto second = FrameLock::try_lock(path, {0, 4, 6});
    EXPECT_TRUE(second);
    EXPECT_FALSE(FrameLock::try_lock(path, {6}));
  }
  EXPECT_TRUE(FrameLock::try_lock(path, {4, 6})) << "a refused or ended lock holds nothing";
  first.reset();
  EXPECT_TRUE(FrameLock::try_lock(path, {1, 2, 3, 4, 5}));
}

TEST_F(GarbageTest, LockOnLinkOrFolder_IsRefused) {
  std::filesystem::create_symlink(root_ / "in/a.txt", root_ / "link");
  EXPECT_THROW(FileLock::try_lock(root_ / "link", FileLock::Mode::Shared), EnvironmentError);
  EXPECT_THROW(FileLock::try_lock(root_ / "in", FileLock::Mode::Shared), EnvironmentError);
  EXPECT_THROW(FileLock::try_lock(root_ / "no/lock", FileLock::Mode::Shared), EnvironmentError);
  EXPECT_THROW(FileLock::try_lock_folder(root_ / "no", FileLock::Mode::Shared), EnvironmentError);
  EXPECT_THROW(FrameLock::try_lock(root_ / "no/lock", {1}), EnvironmentError);
}

}  // namespace
}  // namespace atelier::fixtures
