#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "core/io/polygon_mesh.h"
#include "core/limits.h"

namespace atelier {

/// Reads Wavefront OBJ (Appendix B1 of the Advanced Visualizer manual; colours behind `v` as
/// MeshLab writes them: sRGB in [0,1], all vertices or none). n-gons, negative indices, CRLF, byte
/// order mark, continued lines; indices may point ahead. Groups, objects, materials and material
/// files are kept as names; no material file is opened. Smoothing groups, points and lines are
/// skipped, lines that begin with an unknown word with one finding: a note (mangled comments are
/// common), or a warning where numbers stand behind it (words of other programs, as "vv"). Throws
/// DataError: a number that is none, an index out of range, a face with fewer than 3 or more than
/// 1024 corners, free-form geometry, no vertex, a coordinate or a count beyond the limits.
PolygonMesh read_obj(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits = {});
PolygonMesh read_obj(const std::filesystem::path& path, const Limits& limits = {});

/// OBJ text: numbers are the shortest that read back to the same bits (colours: to 1e-6), in groups
/// and objects as they come. Labels and confidence have no place in OBJ and are left out. Throws
/// LogicError if the mesh is inconsistent or a name has a line break.
std::string obj_text(const PolygonMesh& mesh);

/// `obj_text` into a file, replaced as a whole. Throws EnvironmentError if it cannot be written.
void write_obj(const std::filesystem::path& path, const PolygonMesh& mesh);
void write_obj(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace atelier
