#pragma once

#include <functional>
#include <vector>

#include "core/mesh.h"

namespace atelier {

/// Meshes over time, read lazily: over one topology (`faces` set) or, for scans, one each.
struct Sequence {
  double fps = 0;                             ///< frames per second
  std::vector<int> frame_ids;                 ///< [N], the capture's own numbers, increasing
  Triangles faces;                            ///< [F,3] shared topology; empty if frames differ
  std::function<Mesh(Index frame_idx)> load;  ///< reads one frame; may throw DataError
};

/// Number of frames.
Index frame_count(const Sequence& sequence);

/// Frame `frame_idx` in [0, frame_count), checked: throws LogicError out of range, DataError if
/// what was read is no valid mesh or does not have the shared topology.
Mesh frame(const Sequence& sequence, Index frame_idx);

/// A sequence that holds its meshes in memory. Throws LogicError if sizes differ.
Sequence sequence_of(std::vector<Mesh> meshes, double fps, std::vector<int> frame_ids = {});

}  // namespace atelier
