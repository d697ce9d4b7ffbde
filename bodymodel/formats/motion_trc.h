#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/types.h"

namespace atelier {

/// Points over time, each with a name: markers on a body or keypoints of a detector.
struct MarkerClip {
  std::string name;
  std::vector<std::string> markers;  ///< [M] unique
  double fps = 0;                    ///< frames per second
  double metres_per_unit = 1;        ///< of the file's own unit, as its header says
  std::vector<int> frame_ids;        ///< [N] increasing
  std::vector<Points> positions;     ///< [N] of [M,3] metres, axes as in the file; 0 where unseen
  std::vector<std::vector<bool>> seen;  ///< [N][M]
};

/// Reads TRC (Motion Analysis, OpenSim, Pose2Sim): tab-separated; empty cells and the words nan are
/// markers that were not seen. Units m, cm, mm, in as the header says. Throws DataError, with the
/// line, for a header that is not TRC's, a unit or rate that is none, names that are missing or
/// repeated, a row with more or fewer cells, frames out of order, fewer or more frames than stated.
MarkerClip read_trc(std::span<const std::byte> bytes, const std::string& name,
                    const Limits& limits = {});
MarkerClip read_trc(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
