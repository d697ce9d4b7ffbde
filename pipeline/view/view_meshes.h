#pragma once

#include <filesystem>

#include "core/io/polygon_mesh.h"
#include "pipeline/view/view_scene.h"

namespace atelier {

/// Whether a file is a mesh by its name: .obj .ply .stl .glb .gltf .fbx.
bool is_mesh_file(const std::filesystem::path& file);

/// Whether a place holds meshes over time as other programs and `atelier export` write them: a file
/// .h5 .hdf5 .npz .usd .usda .usdc .usdz by its name, or a folder without folders in it that has
/// meshes (.obj .ply .glb .gltf, or archives named by numbers alone, "000012.h5").
bool holds_mesh_frames(const std::filesystem::path& place);

/// Single meshes of archives, "000012.h5", frames by their names; of any faces. Throws
/// DataError for two of one frame.
Sequence scans_in(const std::filesystem::path& folder, double fps);

/// A mesh of a file. What of it is not shown is a note. Throws DataError.
/// @param otherwise  unit and up axis of a file that does not say
/// @param set        of these what somebody asked for: a note says where the file has its own
ViewScene view_of_mesh(const std::filesystem::path& file, const MeshConvention& otherwise,
                       const MeshConvention& set = {});

/// Meshes over time of a file or a folder for which holds_mesh_frames holds, as one layer; a file
/// of one mesh is that mesh. Frames may differ in topology. Throws DataError, also for a folder
/// with a mesh whose name does not end in its frame's number.
/// @param otherwise  unit and up axis of files that do not say
/// @param set        as above
ViewScene view_of_mesh_frames(const std::filesystem::path& place, const MeshConvention& otherwise,
                              const MeshConvention& set = {});

}  // namespace atelier
