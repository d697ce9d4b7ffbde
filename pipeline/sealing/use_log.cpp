#include "pipeline/sealing/use_log.h"

#include <cstdlib>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file_kind.h"
#include "core/seal/sealed_file.h"
#include "pipeline/sealing/access_log.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNameDigits = 16;

}  // namespace

fs::path use_log_beside(const fs::path& sealed) {
  return fs::path(sealed).concat(".log");
}

fs::path use_log_of_user(const Digest& digest) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state != nullptr && fs::path(state).is_absolute()) {
    folder = state;
  } else if (home != nullptr && fs::path(home).is_absolute()) {
    folder = fs::path(home) / ".local/state";
  } else {
    return {};
  }
  return folder / "atelier/sealed" / (hex(digest).substr(0, kNameDigits) + ".log");
}

void log_use(const OpenedSeal& seal, const std::string& action, const std::string& detail) {
  const std::string said = detail + "; header " + hex(seal.digest);
  try {
    append_to_log(use_log_beside(seal.file), action, said);
    return;
  } catch (const EnvironmentError&) {
    if (use_log_of_user(seal.digest).empty()) {
      throw;
    }
  } catch (const DataError&) {  // something else has that name
    if (use_log_of_user(seal.digest).empty()) {
      throw;
    }
  }
  const fs::path own = use_log_of_user(seal.digest);
  make_private_directory(own.parent_path());
  append_to_log(own, action, said);
}

std::vector<fs::path> use_logs(const fs::path& sealed) {
  std::vector<fs::path> logs;
  for (const fs::path& log :
       {use_log_beside(sealed), use_log_of_user(age_header_digest(read_age_header(sealed)))}) {
    if (!log.empty() && file_kind(log) == fs::file_type::regular) {
      logs.push_back(log);
    }
  }
  return logs;
}

}  // namespace atelier
