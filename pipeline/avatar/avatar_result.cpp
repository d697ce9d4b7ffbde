#include "pipeline/avatar/avatar_result.h"

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/surface_frames.h"
#include "core/error.h"

namespace atelier {

namespace fs = std::filesystem;

BodyAvatar read_body_avatar(const fs::path& result, const BodyModel& person) {
  const fs::path file = result / "avatar.npz";
  const PersonalBody seen = read_personal_body(file);
  if (!equal_arrays(seen.model.mesh.faces, person.mesh.faces) ||
      seen.model.skeleton.names != person.skeleton.names) {
    throw DataError(file.string(), "body", "another person's topology or joints",
                    "an avatar of this person; run 'atelier avatar' again");
  }
  BodyAvatar avatar;
  avatar.rest = seen.model.mesh;
  avatar.displacement = in_surface_frames(surface_frames(person.mesh.vertices, person.mesh.faces),
                                          seen.model.mesh.vertices - person.mesh.vertices);
  avatar.model = result / "body" / "model.safetensors";
  return avatar;
}

std::vector<char> over_clothes(const BodyAvatar& avatar) {
  constexpr double kStandsOff = 0.015;  // m, thicker than what lies under clothes
  std::vector<char> over;
  for (Index v = 0; v < avatar.displacement.rows(); ++v) {
    over.push_back(avatar.displacement.row(v).norm() > kStandsOff ? 1 : 0);
  }
  return over;
}

Points seen_surface(const BodyAvatar& avatar, const Points& body) {
  return body + from_surface_frames(surface_frames(body, avatar.rest.faces), avatar.displacement);
}

}  // namespace atelier
