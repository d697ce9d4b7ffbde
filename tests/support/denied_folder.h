#pragma once

#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include <unistd.h>

namespace atelier::fixtures {

/// A folder that nobody may look into while this is in scope. Root may look everywhere: a test that
/// runs as root is another user meanwhile.
class DeniedFolder {
 public:
  /// @param above  a folder of the test around `folder`; all in it is opened to every user
  DeniedFolder(std::filesystem::path folder, const std::filesystem::path& above)
      : folder_(std::move(folder)) {
    constexpr uid_t kNobody = 65534;
    namespace fs = std::filesystem;
    constexpr fs::perms kLookAt = fs::perms::group_read | fs::perms::others_read;
    constexpr fs::perms kGoThrough = fs::perms::group_exec | fs::perms::others_exec;
    fs::permissions(above, kLookAt | kGoThrough, fs::perm_options::add);
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(above)) {
      const bool goes = entry.is_directory();
      fs::permissions(entry, goes ? kLookAt | kGoThrough : kLookAt, fs::perm_options::add);
    }
    fs::permissions(folder_, fs::perms::none);
    was_root_ = geteuid() == 0 && seteuid(kNobody) == 0;
  }
  ~DeniedFolder() {
    if (was_root_ && seteuid(0) != 0) {
      std::abort();  // the tests that follow would run as somebody else
    }
    std::error_code ignored;
    std::filesystem::permissions(folder_, std::filesystem::perms::owner_all, ignored);
  }
  DeniedFolder(const DeniedFolder&) = delete;
  DeniedFolder& operator=(const DeniedFolder&) = delete;

 private:
  std::filesystem::path folder_;
  bool was_root_ = false;
};

}  // namespace atelier::fixtures
