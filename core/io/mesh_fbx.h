#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "core/io/mesh_gltf.h"
#include "core/limits.h"

namespace atelier {

/// True where this build reads FBX, that is, was made with libassimp.
bool reads_fbx();

/// Reads FBX 7.1 to 7.7, binary or text, into the same plain scene that a glTF file gives: metres,
/// Y up. Above all nodes stands one that says the file's unit and axes (UnitScaleFactor in
/// centimetres, UpAxis, FrontAxis, CoordAxis), so that the rest keeps the file's numbers.
///
/// - All meshes with a skin become one mesh of one skin, a primitive for each mesh and material, in
///   the pose in which they were bound, wherever nodes stood when the file was saved. Its joints
///   are the nodes that move vertices, those between them, the nearest node above all of them, and
///   those below without a mesh (ends of limbs). A file without skins but with an animation gets a
///   skin of the nodes that it moves.
/// - Polygons are triangulated; corners that agree in position, texture coordinate, weights and
///   blend shapes are one vertex.
/// - Blend shapes become morph targets, by name; animations become channels with linear keys that
///   begin at time 0.
///
/// The FBX reader of libassimp is not safe on malformed files: it runs in a process of its own
/// (run_in_worker), which answers with a glTF file that our own reader reads as any other.
///
/// Throws DataError for a file that is no FBX or is damaged, for axes that mirror, for more
/// vertices, faces or joints than the limits allow, and always where reads_fbx() is false, with
/// advice.
GltfScene read_fbx(std::span<const std::byte> bytes, const std::string& name,
                   const Limits& limits = {});
GltfScene read_fbx(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
