#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "appearance/appearance_data.h"
#include "appearance/appearance_model.h"
#include "appearance/train_options.h"
#include "appearance/training.h"

namespace atelier {

/// A file that a user named.
struct NamedFile {
  std::string name;            ///< "MODEL"
  std::filesystem::path path;  ///< "": it was left out
};

/// Whether a file begins as tensors do: the length of a header, eight bytes, and the header.
bool begins_as_tensors(const std::filesystem::path& path);

/// Whether a file begins as those of a kind do.
bool file_begins_with(const std::filesystem::path& path, std::string_view begin);

/// The training that a checkpoint holds. A checkpoint is worth some steps, no more: every refusal
/// says how to do without it. Nobody is told to remove what is none: a network that was trained to
/// its end, or somebody's pictures. Throws DataError.
Training checkpoint_at(const std::filesystem::path& path, const AppearanceData& data,
                       const TrainOptions& options);

/// The network in a file of a workspace's result: what is wrong with it is said with the stage that
/// recomputes it. Throws DataError.
AppearanceModel network_at(const std::filesystem::path& path);

/// The log that is there; "" where there is none. Throws DataError for a text that is no log, which
/// a log would replace.
std::string log_at(const std::filesystem::path& path);

/// Refuses one file in two places: what is written would replace what is read, or the other. Throws
/// UsageError.
void require_different(const std::vector<NamedFile>& places);

/// Refuses a file that could not be written in the end, and to put one in the place of a device, a
/// link or a folder. Throws DataError, EnvironmentError.
void require_result_place(const std::filesystem::path& path);

/// Refuses to replace somebody's file: one that does not begin as those that are written there.
/// @param own  whether it does
void require_own_file(const std::filesystem::path& path, bool own, const char* kind);

}  // namespace atelier
