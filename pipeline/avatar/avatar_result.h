#pragma once

#include <filesystem>
#include <vector>

#include "bodymodel/body_model.h"

namespace atelier {

/// A person's body as it is seen, skin, hair and shoes: what the stage `avatar` makes.
struct BodyAvatar {
  Mesh rest;                    ///< in rest pose, with the atlas of its texture
  Points displacement;          ///< [V,3] m off the personal body, in its surface frames
  std::filesystem::path model;  ///< body/model.safetensors
};

/// Reads a result of `avatar`. Throws DataError unless it is of a body of these faces and joints,
/// which another person's is not.
BodyAvatar read_body_avatar(const std::filesystem::path& result, const BodyModel& person);

/// Which of its vertices lie over clothes where they meet, [V] 1: hair and soles, which stand off
/// the body by more than 1.5 cm.
std::vector<char> over_clothes(const BodyAvatar& avatar);

/// The surface that is seen of a body in any pose, [V,3] m. @param body  [V,3] m
Points seen_surface(const BodyAvatar& avatar, const Points& body);

}  // namespace atelier
