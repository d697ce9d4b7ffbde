#pragma once

// The part of mesh_fbx.h that runs in a process of its own. Only core/io includes this.

#include <cstddef>
#include <span>
#include <string>

#include "core/io/mesh_gltf.h"
#include "core/limits.h"

namespace atelier {

/// The scene of an FBX file, read by libassimp, which may die of it. Throws as read_fbx says.
GltfScene import_fbx(std::span<const std::byte> bytes, const std::string& name,
                     const Limits& limits);

}  // namespace atelier
