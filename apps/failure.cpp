#include "apps/failure.h"

#include <filesystem>
#include <new>

#include "apps/exit_code.h"
#include "apps/usage_error.h"
#include "core/error.h"
#include "core/system_reason.h"

namespace atelier {

Failure failure_of(const std::exception& error) {
  if (const auto* data = dynamic_cast<const DataError*>(&error)) {
    return {error.what(), kExitBadData, data->file, data->where, data->found, data->expected};
  }
  if (dynamic_cast<const UsageError*>(&error) != nullptr) {
    return {error.what(), kExitUsage, "", "", error.what(), ""};
  }
  if (dynamic_cast<const EnvironmentError*>(&error) != nullptr) {
    return {error.what(), kExitEnvironment, "", "", error.what(), ""};
  }
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    const std::string reason = system_reason(file->code().value());
    return {file->path1().string() + ": " + reason,
            kExitEnvironment,
            file->path1().string(),
            "",
            reason,
            ""};
  }
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    return {"memory: there is not enough; use fewer --jobs or smaller data",
            kExitEnvironment,
            "",
            "memory",
            "there is not enough",
            "fewer --jobs or smaller data"};
  }
  return {std::string(error.what()) + "; this is a defect of the program",
          kExitBug,
          "",
          "",
          error.what(),
          "no defect of the program"};
}

}  // namespace atelier
