#include "core/atomic_file.h"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

constexpr std::string_view kPrefix = ".atelier-";
constexpr std::string_view kSuffix = ".tmp";

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& action) {
  const int error = errno;
  throw EnvironmentError(path.string(), action + ": " + system_reason(error));
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path, unsigned mode) : path_(std::move(path)) {
  ATELIER_CHECK(path_.has_filename(), "a file needs a name: " + path_.string());
  std::string pattern =
      (folder_of(path_) / (std::string(kPrefix) + "XXXXXX" + std::string(kSuffix))).string();
  descriptor_ = mkostemps(pattern.data(), static_cast<int>(kSuffix.size()), O_CLOEXEC);
  if (descriptor_ < 0) {
    fail(path_, "cannot create a file in its folder");
  }
  temporary_path_ = pattern;
  if (mode != 0600 && fchmod(descriptor_, mode) != 0) {
    const int error = errno;
    close(descriptor_);
    unlink(temporary_path_.c_str());
    errno = error;
    fail(path_, "cannot set its mode");
  }
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
  if (!temporary_path_.empty()) {
    unlink(temporary_path_.c_str());
  }
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  ATELIER_CHECK(descriptor_ >= 0, "written after commit: " + path_.string());
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      fail(path_, "cannot write");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void AtomicFile::write(std::string_view text) {
  write(std::as_bytes(std::span(text)));
}

void AtomicFile::commit() {
  ATELIER_CHECK(descriptor_ >= 0, "committed twice, or after a failure: " + path_.string());
  // Whatever happens now, the descriptor is done with: a failed fsync is not tried again.
  const int descriptor = std::exchange(descriptor_, -1);
  if (fsync(descriptor) != 0) {
    const int error = errno;
    close(descriptor);
    errno = error;
    fail(path_, "cannot sync");
  }
  if (close(descriptor) != 0) {
    fail(path_, "cannot close");
  }
  if (rename(temporary_path_.c_str(), path_.c_str()) != 0) {
    fail(path_, "cannot rename to it");
  }
  temporary_path_.clear();
  sync_directory(folder_of(path_));
}

void write_file_atomically(const std::filesystem::path& path, std::string_view text,
                           unsigned mode) {
  AtomicFile file(path, mode);
  file.write(text);
  file.commit();
}

bool is_temporary_name(std::string_view file_name) {
  return file_name.size() == kPrefix.size() + 6 + kSuffix.size() &&
         file_name.starts_with(kPrefix) && file_name.ends_with(kSuffix);
}

void remove_temporaries(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> left;
  for (auto entry = std::filesystem::directory_iterator(folder, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    if (is_temporary_name(entry->path().filename().string())) {
      left.push_back(entry->path());
    }
  }
  for (const std::filesystem::path& path : left) {
    if (unlink(path.c_str()) != 0 && errno != ENOENT) {
      fail(path, "cannot remove what an interrupted run left");
    }
  }
}

void make_private_directory(const std::filesystem::path& path) {
  if (path.empty()) {
    return;
  }
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) {
    if (!S_ISDIR(status.st_mode)) {
      errno = ENOTDIR;
      fail(path, "cannot create the folder");
    }
    return;
  }
  if (path.has_parent_path() && path.parent_path() != path) {
    make_private_directory(path.parent_path());
  }
  if (!path.has_filename()) {
    return;  // "folder/": its parent_path was the folder itself
  }
  if (mkdir(path.c_str(), 0700) != 0) {
    // Another process may have been quicker, which is as good.
    if (errno == EEXIST && stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) {
      return;
    }
    fail(path, "cannot create the folder");
  }
  sync_directory(folder_of(path));
}

void sync_directory(const std::filesystem::path& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) {
    fail(path, "cannot open the folder");
  }
  const bool synced = fsync(descriptor) == 0;
  const int error = errno;
  if (close(descriptor) != 0 && synced) {
    fail(path, "cannot close the folder");
  }
  if (!synced) {
    errno = error;
    fail(path, "cannot sync the folder");
  }
}

}  // namespace atelier
