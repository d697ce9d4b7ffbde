#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/sha256.h"
#include "core/store/digest_meter.h"

namespace atelier {

/// Size and SHA-256 of a regular file. Throws DataError if it is missing, a symbolic link or no
/// regular file, EnvironmentError if the disk fails; StopRequested as the meter says, which is
/// asked for every MiB. Cost: reads the file.
struct FileDigest {
  std::int64_t size = 0;
  Digest digest{};
};
FileDigest digest_of_file(const std::filesystem::path& path, DigestMeter& meter);
FileDigest digest_of_file(const std::filesystem::path& path);

/// What a file or a folder holds, so that a change of any name or byte is noticed.
struct InputDigest {
  Digest digest{};
  std::int64_t files = 0;
  std::int64_t bytes = 0;
  Digest stamp{};  ///< of names, sizes and times alone: cheap to take again
};

/// Digest of one file, or of every file below a folder by its relative path in sorted order; names
/// that start with a dot are left out. Links inside a folder are refused, as they may lead out of
/// it; `path` itself may be one. Tells its progress to `events` and throws StopRequested if
/// `events.stop` says so; throws DataError. Cost: reads every file, on several threads.
InputDigest digest_of_input(const std::filesystem::path& path, const StageEvents& events = {});

/// The stamp alone, without reading any file: tells whether an input changed while it was used.
Digest stamp_of_input(const std::filesystem::path& path);

}  // namespace atelier
