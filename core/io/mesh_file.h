#pragma once

#include <filesystem>

#include "core/io/polygon_mesh.h"
#include "core/limits.h"
#include "core/mesh.h"

namespace atelier {

/// Reads a mesh by its extension (.obj, .ply, .glb, .gltf, .fbx; any case) into metres with Y up.
/// `otherwise` is the unit and up axis of a file that does not say (glTF always means metres and
/// Y; FBX says both). A glTF or FBX file is read in its rest pose, all meshes of its scene as one.
/// Throws DataError for a file that is no such mesh, and for another extension.
Mesh read_mesh(const std::filesystem::path& path,
               const MeshConvention& otherwise = {.metres_per_unit = 1, .up = 'y'},
               const Limits& limits = {});

/// Writes a mesh by its extension (.obj, .ply binary with float positions, .glb), replacing the
/// file as a whole. Throws LogicError for another extension or a mesh that is not consistent,
/// DataError for a number that the format cannot hold, EnvironmentError if the file cannot be
/// written.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace atelier
