#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh.h"
#include "core/topology.h"

namespace atelier {

/// Refuses what is neither a word that `seam_input` knows nor a file. Throws DataError.
void require_seams_named(const std::string& seams);

/// The edges of a mesh that are cut, one flag for each edge of its topology: none for "auto" and
/// "none"; where texture coordinates part for "uvs"; where the labels of vertices part for "labels"
/// (a face has the label of most of its corners, of its first where all differ); else those of a
/// JSON file (parse_seams). Throws DataError, for texture coordinates without area as well.
std::vector<char> seam_input(const std::string& seams, const Mesh& mesh, const Topology& topology,
                             const std::filesystem::path& mesh_file);

/// The edges that a JSON text cuts, one flag for each edge: {"seams": [[v0, v1, v2, ...], ...]},
/// runs of vertices along edges, or {"panels": [...]}, the panel of each triangle, from 0 to their
/// number - 1, or both. Throws DataError for what is neither, for vertices and edges that the mesh
/// does not have, and for another number of triangles.
std::vector<char> parse_seams(std::string_view text, const Mesh& mesh, const Topology& topology,
                              const std::string& file = "");

/// Throws DataError for a text that parse_seams takes with no mesh at all.
void check_seams(const std::string& text, const std::string& file);

}  // namespace atelier
