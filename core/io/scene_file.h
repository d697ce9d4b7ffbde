#pragma once

#include <filesystem>

#include "core/io/mesh_gltf.h"
#include "core/limits.h"

namespace atelier {

/// True for a name that ends as scenes do: .glb, .gltf, .fbx, any case.
bool has_scene_extension(const std::filesystem::path& path);

/// Reads a scene by its extension: read_fbx (core/io/mesh_fbx.h) for .fbx, else read_gltf.
GltfScene read_scene(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier
