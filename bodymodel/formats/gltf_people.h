#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/io/mesh_gltf.h"

namespace atelier {

/// The skin that is asked for by its name or its number from 1. Throws UnknownValue.
std::size_t named_skin(const GltfScene& scene, const std::string& wanted, const std::string& file);

/// Whether an animation has keys for the rotation or translation of a joint of a skin.
bool moves_joint_of(const GltfScene& scene, const GltfAnimation& animation, std::size_t skin);

/// The skin that an animation moves, of a scene with skins. Skins that share a joint, or of which
/// one hangs on a joint of the other, are one person's, of which the skin with the most joints is
/// taken. `wanted` is a skin's name or number from 1; "": the first person's who moves, in the
/// order of meshes, and where several move they are named ("motion-skins"). Throws UnknownValue for
/// a skin that is not there.
std::size_t moving_skin(const GltfScene& scene, const GltfAnimation& animation,
                        const std::string& wanted, const std::string& file,
                        std::vector<Finding>& findings);

}  // namespace atelier
