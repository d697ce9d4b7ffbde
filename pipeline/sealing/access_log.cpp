#include "pipeline/sealing/access_log.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <optional>

#include <fcntl.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "core/printable.h"
#include "core/store/utc_time.h"
#include "core/system_reason.h"
#include "core/utf8.h"

namespace atelier {
namespace {

constexpr std::size_t kMaxLine = 4096;
constexpr std::size_t kLogFields = 5;

[[noreturn]] void fail_by_system(const std::filesystem::path& path, const std::string& action) {
  const int error = errno;
  throw EnvironmentError(path.string(), action + ": " + system_reason(error));
}

std::string user_name() {
  const passwd* user = getpwuid(geteuid());
  return user == nullptr ? std::to_string(geteuid()) : printable(user->pw_name);
}

/// Whether a file without a whole line is what a crash may have left of a log's first one: it
/// begins with a time, "2026-11-29T10:40:00Z".
bool may_begin_log(std::string_view text) {
  constexpr std::string_view kTime = "0000-00-00T00:00:00Z";
  for (std::size_t i = 0; i < std::min(text.size(), kTime.size()); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (kTime[i] == '0' ? !digit : text[i] != kTime[i]) {
      return false;
    }
  }
  return text.size() < kTime.size() + 1 || text[kTime.size()] == '\t';
}

/// The log, open and locked.
class LockedLog {
 public:
  explicit LockedLog(const std::filesystem::path& path)
      : path_(path),
        file_(open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0600)) {
    if (file_ < 0) {
      fail_by_system(path_, "cannot open the log");
    }
    while (flock(file_, LOCK_EX) != 0) {
      if (errno != EINTR) {
        close(file_);
        fail_by_system(path_, "cannot lock the log");
      }
    }
  }
  ~LockedLog() { close(file_); }
  LockedLog(const LockedLog&) = delete;
  LockedLog& operator=(const LockedLog&) = delete;

  /// The hash of the last line that is whole; what stands behind that is taken away.
  Digest take_head() const {
    struct stat status {};
    if (fstat(file_, &status) != 0) {
      fail_by_system(path_, "cannot look at the log");
    }
    const off_t start = std::max<off_t>(0, status.st_size - static_cast<off_t>(2 * kMaxLine));
    std::string end(static_cast<std::size_t>(status.st_size - start), '\0');
    if (pread(file_, end.data(), end.size(), start) != static_cast<ssize_t>(end.size())) {
      fail_by_system(path_, "cannot read the log");
    }
    Digest head{};
    const std::size_t last = end.rfind('\n');
    const std::size_t size = last == std::string::npos ? 0 : last + 1;
    if (size == 0 && (start > 0 || !may_begin_log(end))) {
      throw DataError(path_.string(), "", "no log", "lines, as atelier writes them");
    }
    if (size > 0) {
      head = hash_of_line(end, size);
    }
    if (size < end.size()) {
      if (ftruncate(file_, start + static_cast<off_t>(size)) != 0) {
        fail_by_system(path_, "cannot take away what a crash left");
      }
    }
    return head;
  }
  void append(const std::string& line) const {
    if (write(file_, line.data(), line.size()) != static_cast<ssize_t>(line.size()) ||
        fsync(file_) != 0) {
      fail_by_system(path_, "cannot write the log");
    }
  }

 private:
  /// @param end  bytes of the log, of which the first `size` end with its last whole line
  Digest hash_of_line(std::string_view end, std::size_t size) const {
    const std::size_t before = size < 2 ? std::string_view::npos : end.rfind('\n', size - 2);
    const std::size_t line = before == std::string_view::npos ? 0 : before + 1;
    const std::size_t tab = end.rfind('\t', size - 1);
    const auto head = tab == std::string_view::npos || tab < line
                          ? std::nullopt
                          : digest_from_hex(end.substr(tab + 1, size - tab - 2));
    if (!head) {
      throw DataError(path_.string(), "its last line", "no hash",
                      "a log that nobody wrote into; atelier verify --log says where");
    }
    return *head;
  }

  const std::filesystem::path& path_;
  int file_;
};

std::string field(const std::string& text) {
  constexpr std::size_t kMaxField = 900;
  std::string kept = printable(text.substr(0, kMaxField));
  if (!is_printable_utf8(kept)) {  // bytes that are no UTF-8, or a character cut in two
    std::replace_if(
        kept.begin(), kept.end(), [](char c) { return c < 32 || c > 126; }, '?');
  }
  return kept;
}

}  // namespace

std::string access_line(const AccessEntry& entry, const Digest& before) {
  const std::string said =
      entry.time + "\t" + entry.user + "\t" + entry.action + "\t" + entry.detail;
  return said + "\t" + hex(sha256(hex(before) + "\n" + said)) + "\n";
}

void append_to_log(const std::filesystem::path& path, const std::string& action,
                   const std::string& detail) {
  const LockedLog log(path);
  const Digest before = log.take_head();
  const auto now = static_cast<double>(std::time(nullptr));
  log.append(
      access_line({utc_text(now), field(user_name()), field(action), field(detail)}, before));
}

void log_access(const std::filesystem::path& workspace, const std::string& action,
                const std::string& detail) {
  append_to_log(workspace / kAccessLog, action, detail);
}

AccessLog parse_access_log(std::string_view text, const std::string& file) {
  AccessLog log;
  while (!text.empty()) {
    const std::string where = "line " + std::to_string(log.entries.size() + 1);
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos || end > kMaxLine) {
      throw DataError(file, where, "a line that is not whole", "five fields and a line end");
    }
    const std::string_view line = text.substr(0, end);
    std::array<std::string, kLogFields> fields;
    std::size_t at = 0;
    for (std::size_t i = 0; i < kLogFields; ++i) {
      const std::size_t tab = i + 1 < kLogFields ? line.find('\t', at) : line.size();
      if (tab == std::string_view::npos) {
        throw DataError(file, where, "a line with fewer fields", "five, with tabs between");
      }
      fields[i] = line.substr(at, tab - at);
      at = std::min(tab + 1, line.size());
      if (!is_printable_utf8(fields[i])) {
        throw DataError(file, where, "control characters", "printable text");
      }
    }
    const AccessEntry entry{fields[0], fields[1], fields[2], fields[3]};
    if (access_line(entry, log.head) != std::string(line) + "\n") {
      throw DataError(file, where, "a line that does not follow from those before it",
                      "the log as it was written: somebody changed it, or took lines out");
    }
    log.head = *digest_from_hex(fields[4]);
    log.entries.push_back(entry);
    text.remove_prefix(end + 1);
  }
  return log;
}

}  // namespace atelier
