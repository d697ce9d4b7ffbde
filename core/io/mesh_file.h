#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/io/mesh_gltf.h"
#include "core/io/polygon_mesh.h"
#include "core/limits.h"
#include "core/mesh.h"

namespace atelier {

/// Reads a mesh by its extension (.obj, .ply, .glb, .gltf, .fbx, .usdc, .usdz; any case) into
/// metres with Y up. `otherwise` is the unit and up axis of a file that does not say (glTF always
/// means metres and Y; FBX and USD say both). A glTF, FBX or USD file is read in its rest pose, all
/// meshes of its scene as one.
/// Throws DataError for a file that is no such mesh, and for another extension.
Mesh read_mesh(const std::filesystem::path& path,
               const MeshConvention& otherwise = {.metres_per_unit = 1, .up = 'y'},
               const Limits& limits = {});

/// A mesh in metres with Y up, what its file said of its unit and up axis, and what of the file was
/// skipped or a Mesh cannot hold.
struct MeshFile {
  Mesh mesh;
  MeshConvention said;
  std::vector<Finding> findings = {};
};

/// The same, for whoever tells what was said and what was taken.
MeshFile read_mesh_file(const std::filesystem::path& path,
                        const MeshConvention& otherwise = {.metres_per_unit = 1, .up = 'y'},
                        const Limits& limits = {});

/// A scene in its rest pose, all meshes as one, with what its file says and what tears it
/// (torn_mesh_findings). Throws as rest_mesh. @param name  the file
MeshFile mesh_of_scene(const GltfScene& scene, const std::string& name, const Limits& limits = {});

/// The warning "unit-unknown", if the file does not say its unit and what was taken makes the mesh
/// larger than a person or a garment can be; ordinary sizes are no occasion. @param name  the file
std::optional<Finding> unit_finding(const MeshFile& file, const std::string& name);

/// Writes a mesh by its extension (.obj, .ply binary with float positions, .glb), replacing the
/// file as a whole. Throws LogicError for another extension or a mesh that is not consistent,
/// DataError for a number that the format cannot hold, EnvironmentError if the file cannot be
/// written.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace atelier
