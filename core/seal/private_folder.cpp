#include "core/seal/private_folder.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <linux/magic.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/statfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPattern = "atelier-private-XXXXXX";

std::string new_folder(const fs::path& where) {
  std::string name = (where / kPattern).string();
  return mkdtemp(name.data()) == nullptr ? "" : name;
}

bool write_text_to(const char* path, const std::string& text) {
  const int file = open(path, O_WRONLY | O_CLOEXEC);
  const bool written =
      file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (file >= 0) {
    close(file);
  }
  return written;
}

/// A mount namespace of this process's own, in which nothing that is mounted is seen elsewhere. A
/// process without the right gets it in a user namespace, in which it stays the same user.
bool leave_mounts() {
  if (unshare(CLONE_NEWNS) != 0) {
    const uid_t user = geteuid();
    const gid_t group = getegid();
    if (unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) {
      return false;
    }
    const std::string users = std::to_string(user) + " " + std::to_string(user) + " 1";
    const std::string groups = std::to_string(group) + " " + std::to_string(group) + " 1";
    if (!write_text_to("/proc/self/setgroups", "deny") ||
        !write_text_to("/proc/self/gid_map", groups) ||
        !write_text_to("/proc/self/uid_map", users)) {
      return false;
    }
  }
  return mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

/// Pages of 2 MiB halve what writing costs; a file's last ones are small. Kernels that know neither
/// them nor `noswap` refuse the mount.
bool mount_tmpfs(const std::string& place) {
  constexpr unsigned long kFlags = MS_NOSUID | MS_NODEV | MS_NOEXEC;
  for (const char* more : {",noswap,huge=within_size", ",noswap", ""}) {
    const std::string options = std::string("mode=0700,size=100%") + more;
    if (mount("tmpfs", place.c_str(), "tmpfs", kFlags, options.c_str()) == 0) {
      return true;
    }
  }
  return false;
}

bool is_tmpfs(const fs::path& path) {
  struct statfs status {};
  return statfs(path.c_str(), &status) == 0 && status.f_type == TMPFS_MAGIC;
}

/// The child: sleeps until its pipe closes, removes the folder, and ends.
[[noreturn]] void watch(int pipe, const fs::path& folder) {
  setsid();
  for (const int one : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) {
    std::signal(one, SIG_IGN);
  }
  for (int file = 0; file < 1024; ++file) {  // nobody waits for the end of what this one holds open
    if (file != pipe) {
      close(file);
    }
  }
  char nothing = 0;
  while (read(pipe, &nothing, 1) < 0 && errno == EINTR) {
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  _exit(0);
}

}  // namespace

PrivateFolder::PrivateFolder(bool own_mount) {
  if (!own_mount || !mount_own()) {
    make_watched();
  }
  hold_temporaries();
}

void PrivateFolder::hold_temporaries() {
  if (const char* before = std::getenv("TMPDIR"); before != nullptr) {
    tmpdir_before_ = before;
  }
  setenv("TMPDIR", path_.c_str(), 1);
}

bool PrivateFolder::mount_own() {
  const std::string place = new_folder(fs::temp_directory_path());
  if (place.empty()) {
    return false;
  }
  if (!leave_mounts() || !mount_tmpfs(place)) {
    rmdir(place.c_str());
    return false;
  }
  path_ = place;
  mounted_ = true;
  return true;
}

void PrivateFolder::make_watched() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  std::string place;
  for (const fs::path& where :
       {fs::path(runtime == nullptr ? "" : runtime), fs::path("/dev/shm")}) {
    if (place.empty() && !where.empty() && is_tmpfs(where)) {
      place = new_folder(where);
    }
  }
  if (place.empty()) {
    throw EnvironmentError("memory for plain data",
                           "no tmpfs at XDG_RUNTIME_DIR or /dev/shm; unseal into a folder of your "
                           "choice with atelier unseal");
  }
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    const int error = errno;
    rmdir(place.c_str());
    throw EnvironmentError(place, "cannot make a pipe: " + system_reason(error));
  }
  std::fflush(nullptr);
  watcher_id_ = fork();
  if (watcher_id_ == 0) {
    close(ends[1]);
    watch(ends[0], place);
  }
  close(ends[0]);
  watcher_ = ends[1];
  path_ = place;
  if (watcher_id_ < 0) {
    const int error = errno;
    close(watcher_);
    rmdir(place.c_str());
    throw EnvironmentError(place, "cannot start a process: " + system_reason(error));
  }
}

PrivateFolder::~PrivateFolder() {
  tmpdir_before_ ? setenv("TMPDIR", tmpdir_before_->c_str(), 1) : unsetenv("TMPDIR");
  if (mounted_) {
    umount2(path_.c_str(), MNT_DETACH);
    rmdir(path_.c_str());
    return;
  }
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  close(watcher_);
  waitpid(watcher_id_, nullptr, 0);
}

}  // namespace atelier
