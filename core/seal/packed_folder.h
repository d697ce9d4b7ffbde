#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "core/seal/tar.h"

namespace atelier {

/// Size of a packed folder.
struct PackedFolder {
  std::int64_t files = 0;
  std::int64_t bytes = 0;  ///< of the files
};

/// A text that an archive begins with: a file of that name in the folder.
struct FirstFile {
  std::string name;
  std::string text;
};

/// Writes a folder as a tar archive, a piece at a time: `first`, then every file, folder and
/// `current` link below it by name; what begins with a dot (locks, unfinished work) is left out.
/// Throws DataError for other links and for what is no file, and where a file changes meanwhile;
/// EnvironmentError where something cannot be read. Nothing more is read once `stop` is true.
PackedFolder pack_folder(const std::filesystem::path& folder, const FirstFile& first,
                         const ByteSink& sink, const std::function<bool()>& stop = {});

/// Reads the first file of an archive, such as `pack_folder` has it. Throws DataError where there
/// is none of that name, or one of more than 1 MiB.
std::string first_file(TarReader& archive, const std::string& name, const std::string& file);

/// Writes what an archive holds into a new folder, files for their owner alone (0600), folders too
/// (0700). Whole and durable once it returns, and of no worth when it throws: DataError for what
/// TarReader refuses and for a path that comes twice; EnvironmentError for the disk.
/// @param file  the archive's name for errors
PackedFolder unpack_folder(ByteSource source, const std::filesystem::path& folder,
                           const std::string& file, const std::function<bool()>& stop = {});

}  // namespace atelier
