#include "core/store/write_text.h"

#include <cerrno>
#include <string>

#include <fcntl.h>
#include <unistd.h>

#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* action, int error) {
  throw EnvironmentError(path.string(), std::string(action) + ": " + system_reason(error));
}

}  // namespace

void write_text(const std::filesystem::path& path, std::string_view text) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file < 0) {
    fail(path, "cannot open", errno);
  }
  while (!text.empty()) {
    const ssize_t written = write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written < 0) {
      const int error = errno;
      close(file);
      fail(path, "cannot write", error);
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (close(file) != 0) {
    fail(path, "cannot close", errno);
  }
}

}  // namespace atelier
