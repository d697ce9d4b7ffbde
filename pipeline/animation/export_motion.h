#pragma once

#include <filesystem>
#include <vector>

#include "core/io/mesh_gltf.h"
#include "core/io/usd_sequence.h"
#include "core/store/manifest.h"

namespace atelier {

/// Whether a result's file is a motion of ours: "atelier.tracked" or a motion's npz.
bool is_motion_result(const std::filesystem::path& file);

/// Writes such a motion as BVH and, with the joints' places, as TRC. Throws DataError for a file
/// that is damaged.
void export_bvh(const std::filesystem::path& file, const std::filesystem::path& bvh);
void export_trc(const std::filesystem::path& file, const std::filesystem::path& trc);

/// Two scenes side by side, their animations as one. Throws LogicError as check_gltf.
GltfScene joined_scenes(GltfScene scene, const GltfScene& other);

/// Whether a result is of `animate`: a body, its motion, and garments.
bool is_animation_result(const std::filesystem::path& result);

/// The results that such a result was drawn by.
struct AvatarLooks {
  std::filesystem::path networks;  ///< of `appearance`; "": clothes have one colour each
  std::filesystem::path avatar;    ///< of `avatar`; "": the body has one colour
};
AvatarLooks looks_of(const Manifest& manifest, const std::filesystem::path& workspace);

/// Such a result as one scene: the body with its skin, four influences a vertex, moved by its
/// joints, with what each frame's surface is off that as morph targets (gltf_morphs); each garment
/// as morph targets, with normals and the texture that does not change of what `appearance` learnt
/// (joined_scenes, image inside). Nodes and weights are those of the first frame, which programs
/// show that play nothing. Throws DataError for damaged files.
/// With an avatar the body is the seen one, hair and shoes too, with its mean texture.
GltfScene avatar_scene(const std::filesystem::path& result, const AvatarLooks& looks);

/// Such a result as sequences side by side: "body" (as it is seen, where there is an avatar), and
/// each garment under its name.
std::vector<NamedSequence> avatar_sequences(const std::filesystem::path& result);

}  // namespace atelier
