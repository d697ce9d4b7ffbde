#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "appearance/occlusion.h"
#include "appearance/painted_scene.h"
#include "core/render/studio.h"
#include "core/sequence.h"

namespace atelier {

/// Where what is drawn by networks comes from.
struct CastPlaces {
  std::string workspace;
  std::string body;                   ///< meshes; "": those of the stage `body`
  std::vector<std::string> garments;  ///< NAME=MESHES; of the others those of `register`
  std::string capture;                ///< with ground truth, or of whose camera images are
};

/// Everything that moves, as it is drawn.
struct Cast {
  PaintedScene scene;
  std::vector<Sequence> sequences;  ///< of the layers
};

/// Takes a sentence.
using Warn = std::function<void(const std::string& sentence)>;

/// The body first, then every garment that has a network; frames are still to be filled in. Throws
/// DataError, UsageError for names of garments that have none.
Cast cast_of(const CastPlaces& places);

/// The same of the ground truth of the first clothed sequence of a synthetic capture.
Cast true_cast(const CastPlaces& places);

/// The body as it is seen, where the workspace has an avatar of its faces.
void show_avatar(Cast& cast, const std::filesystem::path& workspace);

/// Refuses a garment's meshes as the body's, and warns of meshes that are not as the workspace's:
/// without its network a body is drawn whatever its faces are.
void require_body(const Cast& cast, const CastPlaces& places, const Warn& warn);

/// Requires the light that the networks learnt with: they know no other. Throws UsageError.
void require_light(const Cast& cast, const OcclusionOptions& asked);

/// Frames in which every layer is there, with its vertices.
/// @param chosen  numbers of those that are drawn; none: all
void fill_frames(Cast& cast, const std::vector<double>& chosen, const Warn& warn);

/// Cameras round the subject: one, or one for each frame.
std::vector<Camera> cameras_round(const Cast& cast, const View& view, bool turn,
                                  const PictureOptions& picture);

/// Frames a second at which the sequences are played, 0 where none says it. Throws DataError where
/// two say another: frames of one number are then of other moments.
double cast_rate(const Cast& cast);

}  // namespace atelier
