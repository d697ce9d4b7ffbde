#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "appearance/surface_frame.h"
#include "bodymodel/body_model.h"

namespace atelier {

/// A person's body as it is seen, skin, hair and shoes: what the stage `avatar` makes.
struct BodyAvatar {
  Mesh rest;                    ///< in rest pose, with the atlas of its texture
  Points displacement;          ///< [V,3] m off the personal body, in its surface frames
  std::filesystem::path model;  ///< body/model.safetensors
  bool posed = false;           ///< whether its network moves the surface with the pose, too
};

/// Reads a result of `avatar`. Throws DataError unless it is of a body of these faces and bones,
/// which another person's is not.
BodyAvatar read_body_avatar(const std::filesystem::path& result, const BodyModel& person);

/// The avatar of a person's body with this seen surface for its rest surface, without a texture.
BodyAvatar body_avatar(const Mesh& seen, const BodyModel& person);

/// Which of its vertices lie over clothes where they meet, [V] 1: hair and soles, which stand off
/// the body by more than 1.5 cm.
std::vector<char> over_clothes(const BodyAvatar& avatar);

/// The surface that is seen of a body in any pose, [V,3] m. @param body  [V,3] m
Points seen_surface(const BodyAvatar& avatar, const Points& body);

/// The same surface moved by what its pose does to it. @param offset  [V,3] m, of pose_offsets
Points seen_surface(const BodyAvatar& avatar, const Points& body, const FloatRows& offset);

/// By what each pose moves the seen surface, [N] of [V,3] m in its own axes, of the avatar's
/// network; nothing where that does not move it, or without libtorch. @param bodies  [N] of [V,3]
std::vector<FloatRows> pose_offsets(const BodyAvatar& avatar, const std::vector<Points>& bodies);

/// The seen surfaces of a sequence of bodies, by their number from 0, moved by what their poses do;
/// asked of the network for some frames at a time. May be called by several threads.
/// @param body  of a number below `count`
std::function<Points(Index)> seen_bodies(BodyAvatar avatar, Index count,
                                         std::function<Points(Index)> body);

}  // namespace atelier
