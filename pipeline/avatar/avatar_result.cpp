#include "pipeline/avatar/avatar_result.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "appearance/body_surfaces.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/surface_frames.h"
#include "core/archive.h"
#include "core/error.h"
#include "core/io/child_program.h"
#include "core/io/temporary_folder.h"
#include "pipeline/avatar/avatar_drawing.h"

namespace atelier {

namespace fs = std::filesystem;

BodyAvatar body_avatar(const Mesh& seen, const BodyModel& person) {
  BodyAvatar avatar;
  avatar.rest = seen;
  avatar.displacement = in_surface_frames(surface_frames(person.mesh.vertices, person.mesh.faces),
                                          seen.vertices - person.mesh.vertices);
  return avatar;
}

BodyAvatar read_body_avatar(const fs::path& result, const BodyModel& person) {
  const fs::path file = result / "avatar.npz";
  const PersonalBody seen = read_personal_body(file);
  constexpr double kSame = 1e-6;  // m, that bones may differ by
  const Skeleton& bones = seen.model.skeleton;
  if (!equal_arrays(seen.model.mesh.faces, person.mesh.faces) ||
      bones.names != person.skeleton.names ||
      (bones.offsets - person.skeleton.offsets).cwiseAbs().maxCoeff() > kSame) {
    throw DataError(file.string(), "body", "another topology or other bones",
                    "an avatar of this person as 'atelier personalize' has them; run 'atelier "
                    "avatar' again");
  }
  BodyAvatar avatar = body_avatar(seen.model.mesh, person);
  avatar.model = result / "body" / "model.safetensors";
  if (fs::exists(avatar.model)) {
    avatar.posed = avatar_model_at(avatar.model).options.geometry;
  }
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

Points seen_surface(const BodyAvatar& avatar, const Points& body, const FloatRows& offset) {
  const Points mean = seen_surface(avatar, body);
  return mean + from_surface_frames(surface_frames(mean, avatar.rest.faces), offset.cast<double>());
}

std::vector<FloatRows> pose_offsets(const BodyAvatar& avatar, const std::vector<Points>& bodies) {
  if (!avatar.posed || bodies.empty() || !has_child_program("atelier-appearance")) {
    return {};
  }
  std::vector<FloatRows> surfaces;
  for (const Points& body : bodies) {
    surfaces.push_back(seen_surface(avatar, body).cast<float>());
  }
  const TemporaryFolder between;
  const fs::path from = between.path / "surfaces.h5";
  const fs::path to = between.path / "offsets.h5";
  write_archive(from, archive_of_surfaces(surfaces));
  run_child_program(
      "atelier-appearance", {"shape", avatar.model.string(), from.string(), to.string()},
      "a build with libtorch (libtorch-dev)", [](const std::string&) {}, [] { return false; });
  std::vector<FloatRows> offsets = surfaces_of(read_archive(to, kSurfacesSchema, 1), to.string());
  if (offsets.size() != bodies.size() || offsets[0].rows() != bodies[0].rows()) {
    throw DataError(to.string(), "frames/rows", "other surfaces", "those that were asked for");
  }
  return offsets;
}

std::function<Points(Index)> seen_bodies(BodyAvatar avatar, Index count,
                                         std::function<Points(Index)> body) {
  constexpr Index kPiece = 64;  // frames, for which a program is started
  struct Piece {
    std::mutex lock;
    Index first = -1;
    std::vector<FloatRows> offsets;
  };
  const bool posed = avatar.posed && has_child_program("atelier-appearance");
  return [avatar = std::make_shared<const BodyAvatar>(std::move(avatar)), count, posed,
          body = std::move(body), piece = std::make_shared<Piece>()](Index i) {
    if (!posed) {
      return seen_surface(*avatar, body(i));
    }
    const std::lock_guard hold(piece->lock);
    const Index first = i / kPiece * kPiece;
    if (piece->first != first) {
      std::vector<Points> bodies;
      for (Index at = first; at < std::min(count, first + kPiece); ++at) {
        bodies.push_back(body(at));
      }
      piece->offsets = pose_offsets(*avatar, bodies);
      piece->first = first;
    }
    return seen_surface(*avatar, body(i), piece->offsets[static_cast<std::size_t>(i - first)]);
  };
}

Points seen_surface(const BodyAvatar& avatar, const Points& body) {
  return body + from_surface_frames(surface_frames(body, avatar.rest.faces), avatar.displacement);
}

}  // namespace atelier
