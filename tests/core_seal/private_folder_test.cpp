// Plain data in memory: gone with the process, by whichever way and however it ends.
#include "core/seal/private_folder.h"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/seal/secret.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;

/// What a child process that made a private folder tells of it.
struct Told {
  char path[200] = "";
  bool mounted = false;
  bool private_mode = false;
  bool written = false;
};

/// A child with a private folder and a file in it, which ends by SIGKILL once it is told to.
class KilledHolder {
 public:
  explicit KilledHolder(bool own_mount) {
    int told[2];
    EXPECT_EQ(pipe(told), 0);
    pid_ = fork();
    if (pid_ == 0) {
      Told say;
      PrivateFolder folder(own_mount);
      struct stat status {};
      say.private_mode =
          stat(folder.path().c_str(), &status) == 0 && (status.st_mode & 0777) == 0700;
      say.mounted = folder.is_mounted();
      folder.path().string().copy(say.path, sizeof say.path - 1);
      fs::create_directories(folder.path() / "deep");
      std::ofstream(folder.path() / "deep/plain") << "a secret";
      say.written = fs::file_size(folder.path() / "deep/plain") == 8;
      [[maybe_unused]] const ssize_t sent = ::write(told[1], &say, sizeof say);
      pause();
      _exit(0);
    }
    close(told[1]);
    EXPECT_EQ(read(told[0], &told_, sizeof told_), static_cast<ssize_t>(sizeof told_));
    close(told[0]);
  }
  ~KilledHolder() { kill(); }
  KilledHolder(const KilledHolder&) = delete;
  KilledHolder& operator=(const KilledHolder&) = delete;

  const Told& told() const { return told_; }
  void kill() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
      pid_ = -1;
    }
  }

 private:
  pid_t pid_ = -1;
  Told told_;
};

/// Whether something is gone after a while.
bool goes(const fs::path& path) {
  for (int i = 0; i < 500 && fs::exists(path); ++i) {
    usleep(20'000);
  }
  return !fs::exists(path);
}

TEST(PrivateFolder, OwnMount_IsSeenByNobodyElse) {
  KilledHolder holder(true);
  if (!holder.told().mounted) {
    GTEST_SKIP() << "no mount namespaces here";
  }
  EXPECT_TRUE(holder.told().written && holder.told().private_mode);
  EXPECT_TRUE(fs::is_empty(holder.told().path)) << "as every other process sees it";
  holder.kill();
  EXPECT_TRUE(fs::is_empty(holder.told().path));
  fs::remove(holder.told().path);
}

TEST(PrivateFolder, WatchedFolder_IsGoneAfterAKill) {
  KilledHolder holder(false);
  EXPECT_TRUE(holder.told().written && holder.told().private_mode);
  EXPECT_FALSE(holder.told().mounted);
  EXPECT_TRUE(fs::exists(fs::path(holder.told().path) / "deep/plain"));
  holder.kill();
  EXPECT_TRUE(goes(holder.told().path));
}

TEST(PrivateFolder, EndOfScope_RemovesIt) {
  fs::path place;
  {
    const PrivateFolder folder(false);
    place = folder.path();
    std::ofstream(place / "plain") << "a secret";
  }
  EXPECT_FALSE(fs::exists(place));
}

TEST(PrivateFolder, TemporaryFilesOfTheProcess_LieInIt) {
  const fs::path before = fs::temp_directory_path();
  {
    const PrivateFolder folder(false);
    EXPECT_EQ(fs::temp_directory_path(), folder.path());
  }
  EXPECT_EQ(fs::temp_directory_path(), before);
}

TEST(Secret, Memory_IsLockedAndLeftOutOfDumps) {
  const Secret secret(bytes_of("0123456789"));
  // The flags of its pages: lo: locked, dd: not in core dumps.
  std::ifstream maps("/proc/self/smaps");
  const auto place = reinterpret_cast<std::uintptr_t>(secret.data());
  bool inside = false;
  std::string flags;
  for (std::string line; flags.empty() && std::getline(maps, line);) {
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx", &begin, &end) == 2) {
      inside = begin <= place && place < end;
    } else if (inside && line.starts_with("VmFlags:")) {
      flags = line;
    }
  }
  EXPECT_THAT(flags, ::testing::HasSubstr(" dd"));
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer locks nothing";
#else
  rlimit limit{};
  constexpr rlim_t kPages = 65536;  // bytes, that a secret and its guards need
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0 || limit.rlim_cur < kPages) {
    GTEST_SKIP() << "ulimit -l allows no locked memory";
  }
  EXPECT_THAT(flags, ::testing::HasSubstr(" lo"));
#endif
}

}  // namespace
}  // namespace atelier::fixtures
