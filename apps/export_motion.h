#pragma once

#ifdef ATELIER_HAS_BODYMODEL

#include <filesystem>

#include "core/io/mesh_gltf.h"

namespace atelier {

/// Whether a result's file is a motion of ours: "atelier.tracked" or a motion's npz.
bool is_motion_result(const std::filesystem::path& file);

/// Writes such a motion as BVH. Throws DataError for a file that is damaged.
void export_bvh(const std::filesystem::path& file, const std::filesystem::path& bvh);

/// Two scenes side by side, their animations as one. Throws LogicError as check_gltf.
GltfScene joined_scenes(GltfScene scene, const GltfScene& other);

/// Whether a result is of `animate`: a body, its motion, and garments.
bool is_animation_result(const std::filesystem::path& result);

/// Such a result as one scene: the body with its skin, four influences a vertex, moved by its
/// joints; each garment as morph targets, a frame each. Throws DataError for damaged files.
GltfScene avatar_scene(const std::filesystem::path& result);

}  // namespace atelier

#endif
