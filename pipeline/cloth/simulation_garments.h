#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/garment.h"
#include "pipeline/cloth/simulation_scene.h"

namespace atelier {

/// Garments of a text: one file, or several joined by "+", the inner first. A file whose own name
/// has a "+" is one. Throws UsageError for a garment without a name.
std::vector<std::filesystem::path> garment_paths(const std::string& text);

/// Stems of the garments' files, told apart by their place where two are alike.
std::vector<std::string> garment_names(const std::vector<std::filesystem::path>& files);

/// Reads the garments, meshes or archives (core/garment_archive.h), as they are put on: all of them
/// scaled and moved alike, of one material, with their seams closed. Each is named by its file.
/// Throws DataError for files that are none, UsageError for what their options cannot do to them.
std::vector<Garment> placed_garments(const std::vector<std::filesystem::path>& files,
                                     const SimulateOptions& options);

/// Vertices near the top, down to `depth` [m] below it, move with the body's nearest triangle, as a
/// waistband or collar does. A vertex is told by its foot on the triangle's plane, so that it
/// starts exactly where it is.
void attach_top(Garment& garment, const Points& body, const Triangles& faces, double depth);

}  // namespace atelier
