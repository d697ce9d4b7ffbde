#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/io/mesh_file.h"
#include "core/limits.h"
#include "core/sequence.h"

namespace atelier {

/// A folder of meshes, one file a frame, as a Sequence: files `read_mesh` knows (.obj, .ply, .glb,
/// .gltf), whose names end in the frame's number before the extension ("scan-f00012.ply"). Other
/// files, folders and names that start with a dot are passed over. A single mesh file is a sequence
/// of frame 0. Frames are read when asked for; each may have a topology of its own; the frames per
/// second are unknown (0). `otherwise` is the unit and axis of files that do not say.
///
/// Throws DataError if there is no mesh, a mesh's name has no number or leads to no file (a link to
/// nothing, a pipe), two have the same, or there are more than `limits.frames`.
Sequence read_sequence_folder(const std::filesystem::path& path,
                              const MeshConvention& otherwise = {.metres_per_unit = 1, .up = 'y'},
                              const Limits& limits = {});

/// A note of the numbers between the first and the last that no frame has, a few of them named.
/// @param frame_ids  increasing, at least one
std::optional<Finding> gap_finding(const std::vector<int>& frame_ids, const std::string& place);

/// Its first frame, with what that file says of its unit and axis. Throws as both do.
MeshFile read_first_mesh(const std::filesystem::path& path,
                         const MeshConvention& otherwise = {.metres_per_unit = 1, .up = 'y'},
                         const Limits& limits = {});

}  // namespace atelier
