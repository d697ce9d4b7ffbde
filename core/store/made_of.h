#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace atelier {

/// The note in a folder that `atelier run` makes of results for a stage that reads them as its
/// INPUT: a version, of each result a line `<stage> <key16>`, their consent, and the folder's
/// files with their digests.
inline constexpr const char* kMadeOfFile = "made_of.txt";

/// A result by its place in a workspace: `<stage>/<key16>`.
struct ResultName {
  std::string stage;
  std::string key16;
};

/// The place of an INPUT in a workspace that was copied or moved since the stage read it: the same
/// folder, file of it, or result inside of this workspace, where there is one and the former place
/// is gone or also has a note. Any other INPUT as it is.
std::filesystem::path place_now(const std::filesystem::path& workspace,
                                const std::filesystem::path& input);

/// The results of a workspace that an INPUT inside of it, however its path is written, is made of:
/// those that the folder's note names, also for one file that the note has, or the one that it is
/// or lies in, or was before it was removed, as where a result is handed over (`refine`). None of
/// any other INPUT, and where the note cannot be read.
std::vector<ResultName> results_behind(const std::filesystem::path& workspace,
                                       const std::filesystem::path& input);

}  // namespace atelier
