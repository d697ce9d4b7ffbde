#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/sha256.h"

namespace atelier {

/// The log of a workspace, or of a sealed file (use_log.h): who did what with it. Lines are only
/// ever appended, and each has the hash of all before it, so that what is changed or taken out
/// later is noticed.
inline constexpr const char* kAccessLog = "access.log";

/// One line: five fields with tabs between, the last the SHA-256 of the line before it (zeros for
/// the first), a line end and the other four.
struct AccessEntry {
  std::string time;    ///< "2026-11-29T10:40:00Z"
  std::string user;    ///< of the system
  std::string action;  ///< the command, "export", "seal", ..., or "open"
  std::string detail;  ///< where to, for whom, for what; without control characters
};

struct AccessLog {
  std::vector<AccessEntry> entries;
  Digest head{};  ///< hash of the last line; zeros of an empty log
};

/// Appends a line to a workspace's log, as whoever runs the program, now, under a lock, durably.
/// What a crash left of a line is taken away. Throws EnvironmentError; DataError where the log's
/// last line is none.
void log_access(const std::filesystem::path& workspace, const std::string& action,
                const std::string& detail);

/// The same of a log with another name. What is no log is never written into.
void append_to_log(const std::filesystem::path& log, const std::string& action,
                   const std::string& detail);

/// The line of an entry behind one of that hash.
std::string access_line(const AccessEntry& entry, const Digest& before);

/// Reads a log and checks its chain. Throws DataError with the first line that does not follow from
/// those before it. That lines are missing at the end shows only to whoever kept the head.
AccessLog parse_access_log(std::string_view text, const std::string& file);

}  // namespace atelier
