#pragma once

#ifdef ATELIER_HAS_REGISTRATION

#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {

/// The edges of a mesh that are cut, one flag for each edge of its topology: none for "auto" and
/// "none"; where texture coordinates part for "uvs"; where the labels of vertices part for "labels"
/// (a face has the label of most of its corners, of its first where all differ); else those of a
/// JSON file: {"seams": [[v0, v1, v2, ...], ...]}, runs of vertices along edges, or {"panels":
/// [...]}, the panel of each triangle, or both. Throws DataError.
std::vector<char> seam_input(const std::string& seams, const Mesh& mesh, const Topology& topology,
                             const std::filesystem::path& mesh_file);

}  // namespace atelier

#endif
