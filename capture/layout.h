#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace atelier {

/// What a capture looks like in another layout: where it went, and what that layout cannot hold.
struct LayoutReport {
  std::vector<std::filesystem::path> folders;  ///< one for each sequence
  std::vector<std::string> lost;               ///< one sentence each
};

/// "easymocap", "colmap", "panoptic", "dna", "actorshq", "nerfstudio".
const std::vector<std::string>& layout_names();

/// Writes a finished native capture in another layout, a folder for each sequence under `out`
/// (new). Units, axes, pixel origins and distortion orders are those of the layout
/// (docs/formats.md); images are hard links where the disk allows, else copies. Calibrations come
/// last, so that what was interrupted has none. Throws DataError for a capture that is not whole,
/// LogicError for a layout that is none of the above, EnvironmentError for a folder that is there
/// or a disk that fails.
LayoutReport write_layout(const std::filesystem::path& capture, const std::string& layout,
                          const std::filesystem::path& out);

}  // namespace atelier
