#pragma once

#include <filesystem>

#include "core/store/file_lock.h"

namespace atelier {

/// Where a workspace keeps its report and the account of its last run.
std::filesystem::path report_folder(const std::filesystem::path& workspace);

/// Makes the folder if it is missing, waits until nobody else writes there, removes what killed
/// writers left, and keeps others out as long as the lock is held. Throws EnvironmentError.
FileLock lock_report_folder(const std::filesystem::path& workspace);

}  // namespace atelier
