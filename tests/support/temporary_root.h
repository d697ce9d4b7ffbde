#pragma once

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace atelier::fixtures {

/// The one folder for temporary files of a test program and of all that it starts (TMPDIR): gone at
/// its end, whatever failed. A program that was killed cannot remove its own; the next one does,
/// since the lock that told it to be alive is free.
class TemporaryRoot {
 public:
  TemporaryRoot() {
    remove_abandoned();
    std::string pattern = (std::filesystem::temp_directory_path() / kName).string() + "XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) {
      throw std::runtime_error("mkdtemp failed for " + pattern);
    }
    path_ = pattern;
    chmod(path_.c_str(), 0711);  // tests give up root's rights, and still find their folders
    lock_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    flock(lock_, LOCK_EX);
    setenv("TMPDIR", path_.c_str(), 1);
  }
  ~TemporaryRoot() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
    close(lock_);
  }
  TemporaryRoot(const TemporaryRoot&) = delete;
  TemporaryRoot& operator=(const TemporaryRoot&) = delete;

 private:
  static constexpr const char* kName = "atelier-tests-";

  static void remove_abandoned() {
    // Between its making and its lock a folder looks abandoned.
    constexpr std::chrono::minutes kYoung(5);
    const auto now = std::filesystem::file_time_type::clock::now();
    std::error_code ignored;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::temp_directory_path(), ignored)) {
      if (!entry.path().filename().string().starts_with(kName) ||
          now - entry.last_write_time(ignored) < kYoung) {
        continue;
      }
      const int lock = open(entry.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
      if (lock >= 0 && flock(lock, LOCK_EX | LOCK_NB) == 0) {
        std::filesystem::remove_all(entry.path(), ignored);
      }
      if (lock >= 0) {
        close(lock);
      }
    }
  }

  std::filesystem::path path_;
  int lock_ = -1;
};

}  // namespace atelier::fixtures
