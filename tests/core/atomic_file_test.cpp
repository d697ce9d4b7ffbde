#include "core/atomic_file.h"

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "tests/support/leave.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

unsigned mode_of(const std::filesystem::path& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0);
  return status.st_mode & 0777;
}

std::size_t files_in(const std::filesystem::path& folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) {
    ++count;
  }
  return count;
}

TEST(AtomicFile, File_AppearsCompleteAtCommit) {
  const fixtures::TemporaryDirectory folder;
  AtomicFile file(folder / "a");
  file.write("hello ");
  file.write("world");
  EXPECT_FALSE(std::filesystem::exists(folder / "a"));
  EXPECT_EQ(content(file.temporary_path()), "hello world");
  file.commit();
  EXPECT_EQ(content(folder / "a"), "hello world");
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, WrittenFile_IsReadableByOwnerOnly) {
  const fixtures::TemporaryDirectory folder;
  write_file_atomically(folder / "a", "x");
  EXPECT_EQ(mode_of(folder / "a"), 0600u);
  write_file_atomically(folder / "b", "x", 0644);
  EXPECT_EQ(mode_of(folder / "b"), 0644u);
}

TEST(AtomicFile, ExistingFile_IsReplaced) {
  const fixtures::TemporaryDirectory folder;
  write_file_atomically(folder / "a", "old and longer");
  write_file_atomically(folder / "a", "new");
  EXPECT_EQ(content(folder / "a"), "new");
}

TEST(AtomicFile, UncommittedWrite_LeavesNothingBehind) {
  const fixtures::TemporaryDirectory folder;
  write_file_atomically(folder / "a", "old");
  {
    AtomicFile file(folder / "a");
    file.write("new");
  }
  EXPECT_EQ(content(folder / "a"), "old");
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, ExceptionBeforeCommit_LeavesNothingBehind) {
  const fixtures::TemporaryDirectory folder;
  try {
    AtomicFile file(folder / "a");
    file.write("half");
    throw std::runtime_error("unwinding");
  } catch (const std::runtime_error&) {
  }
  EXPECT_EQ(files_in(folder.path()), 0u);
}

TEST(AtomicFile, WriteByTemporaryPath_IsCommitted) {
  const fixtures::TemporaryDirectory folder;
  AtomicFile file(folder / "a");
  std::ofstream(file.temporary_path(), std::ios::trunc) << "by another descriptor";
  file.commit();
  EXPECT_EQ(content(folder / "a"), "by another descriptor");
}

TEST(AtomicFile, TemporaryNames_AreRecognized) {
  const fixtures::TemporaryDirectory folder;
  const AtomicFile file(folder / "a");
  EXPECT_TRUE(is_temporary_name(file.temporary_path().filename().string()));
  EXPECT_FALSE(is_temporary_name("a"));
  EXPECT_FALSE(is_temporary_name(".atelier-.tmp"));
  EXPECT_FALSE(is_temporary_name("manifest.json"));
}

TEST(AtomicFile, StaleTemporaries_AreRemovedAndNothingElse) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / ".atelier-a1b2c3.tmp") << "half";
  std::ofstream(folder / ".atelier-.tmp") << "somebody's own";
  std::ofstream(folder / "a") << "whole";
  remove_temporaries(folder.path());
  EXPECT_FALSE(std::filesystem::exists(folder / ".atelier-a1b2c3.tmp"));
  EXPECT_EQ(files_in(folder.path()), 2U);
  remove_temporaries(folder / "nothing");
}

TEST(AtomicFile, LongestFileName_Works) {
  const fixtures::TemporaryDirectory folder;
  write_file_atomically(folder / std::string(255, 'n'), "x");
  EXPECT_EQ(content(folder / std::string(255, 'n')), "x");
}

TEST(AtomicFile, MissingFolder_IsEnvironmentErrorWithPath) {
  const fixtures::TemporaryDirectory folder;
  try {
    AtomicFile file(folder / "missing/a");
    FAIL();
  } catch (const EnvironmentError& error) {
    EXPECT_THAT(error.what(), HasSubstr((folder / "missing/a").string()));
    EXPECT_THAT(error.what(), HasSubstr("No such file or directory"));
  }
}

TEST(AtomicFile, FolderOfSameName_IsNotReplaced) {
  const fixtures::TemporaryDirectory folder;
  std::filesystem::create_directory(folder / "a");
  EXPECT_THROW(write_file_atomically(folder / "a", "x"), EnvironmentError);
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a"));
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, Misuse_ThrowsLogicError) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_THROW(AtomicFile(folder.path() / ""), LogicError);
  AtomicFile file(folder / "a");
  file.commit();
  EXPECT_THROW(file.commit(), LogicError);
  EXPECT_THROW(file.write("x"), LogicError);
}

/// Runs `action` in a child whose files may not exceed 4,096 bytes (EFBIG stands for a full disk);
/// true if it ended with EnvironmentError and the words.
bool fails_on_a_small_disk(const std::function<void()>& action, const std::string& words) {
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, RLIM_INFINITY};
    setrlimit(RLIMIT_FSIZE, &limit);
    int code = 1;
    try {
      action();
    } catch (const EnvironmentError& error) {
      code = std::string(error.what()).find(words) != std::string::npos ? 0 : 2;
    }
    fixtures::leave(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(AtomicFile, FullDisk_KeepsOldFile) {
  const fixtures::TemporaryDirectory folder;
  write_file_atomically(folder / "a", "old");
  EXPECT_TRUE(
      fails_on_a_small_disk([&] { write_file_atomically(folder / "a", std::string(10'000, 'x')); },
                            (folder / "a").string() + ": cannot write"));
  EXPECT_EQ(content(folder / "a"), "old");
  EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(AtomicFile, DevFull_IsEnvironmentError) {
  // A descriptor whose every write fails with ENOSPC, put in the place of the temporary file.
  const fixtures::TemporaryDirectory folder;
  const pid_t child = fork();
  if (child == 0) {
    AtomicFile file(folder / "a");
    int descriptor = -1;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
      std::error_code ignored;
      if (std::filesystem::read_symlink(entry.path(), ignored) == file.temporary_path()) {
        descriptor = std::stoi(entry.path().filename().string());
      }
    }
    dup2(open("/dev/full", O_WRONLY), descriptor);
    int code = 1;
    try {
      file.write("x");
    } catch (const EnvironmentError& error) {
      code = std::string(error.what()).find("No space left") != std::string::npos ? 0 : 2;
    }
    fixtures::leave(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(PrivateDirectory, NestedFolders_AreAccessibleByOwnerOnly) {
  const fixtures::TemporaryDirectory folder;
  make_private_directory(folder / "a/b/c/");
  for (const char* name : {"a", "a/b", "a/b/c"}) {
    EXPECT_EQ(mode_of(folder / name), 0700u) << name;
  }
}

TEST(PrivateDirectory, ExistingFolder_KeepsItsMode) {
  const fixtures::TemporaryDirectory folder;
  std::filesystem::create_directory(folder / "a");
  chmod((folder / "a").c_str(), 0755);
  make_private_directory(folder / "a");
  EXPECT_EQ(mode_of(folder / "a"), 0755u);
}

TEST(PrivateDirectory, FileInTheWay_IsEnvironmentError) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "a") << "x";
  EXPECT_THROW(make_private_directory(folder / "a"), EnvironmentError);
  EXPECT_THROW(make_private_directory(folder / "a/b"), EnvironmentError);
}

TEST(SyncDirectory, MissingFolder_IsEnvironmentError) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_NO_THROW(sync_directory(folder.path()));
  EXPECT_THROW(sync_directory(folder / "missing"), EnvironmentError);
}

}  // namespace
}  // namespace atelier
