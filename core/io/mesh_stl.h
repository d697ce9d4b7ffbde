#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "core/io/polygon_mesh.h"
#include "core/limits.h"

namespace atelier {

/// Reads STL (3D Systems 1989), text or binary: text begins with "solid" and binary files may too,
/// so that a file is binary where it has bytes for the triangles that it counts. Corners at exactly
/// the same place are one vertex, in order of their first use ("stl-joined" says how many): STL has
/// no vertices, and a surface would fall apart. Several solids become one mesh. Normals are those
/// of the triangles and are not kept, nor are the two bytes behind each. A file with more whole
/// triangles than it counts, as VTK writes strips, is read to its end, and a few line ends or zeros
/// behind the last one are passed over ("stl-count"). The unit is never said.
///
/// Throws DataError, with the byte or the line, for a size that is not that of the triangles, a
/// facet without three corners, numbers that are none or not finite, no triangle at all, a
/// coordinate or a count beyond the limits.
PolygonMesh read_stl(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits = {});
PolygonMesh read_stl(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
