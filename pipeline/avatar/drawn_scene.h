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

/// The folders and files that surfaces drawn by networks are read from.
struct DrawnSources {
  std::string workspace;
  std::string body;                   ///< meshes; "": those of the stage `body`
  std::vector<std::string> garments;  ///< NAME=MESHES; of the others those of `register`
  std::string capture;                ///< with ground truth, or with the camera images to match
};

/// Body and garments with their networks, as layers, and the sequences that move them.
struct DrawnScene {
  PaintedScene scene;
  std::vector<Sequence> sequences;  ///< one for each layer
};

/// Takes a sentence.
using Warn = std::function<void(const std::string& sentence)>;

/// The body, then every garment that has a network; frames are added by fill_frames. Throws
/// DataError, UsageError for names of garments without one.
DrawnScene drawn_scene(const DrawnSources& sources);

/// The same for the ground truth of the first clothed sequence of a synthetic capture, with the
/// networks of `oracle`.
DrawnScene ground_truth_scene(const DrawnSources& sources);

/// Draws the body with the network and surface of the workspace's `avatar`, where there is one with
/// the body's faces.
void use_avatar(DrawnScene& drawn, const std::filesystem::path& workspace);

/// Refuses a garment's meshes in place of the body's, and warns of meshes with other faces than the
/// workspace's body: without its network a body is drawn whatever its faces are.
void require_body(const DrawnScene& drawn, const DrawnSources& sources, const Warn& warn);

/// Requires the light that the networks were trained with; they know no other. Throws UsageError.
void require_light(const DrawnScene& drawn, const OcclusionOptions& asked);

/// Adds the vertices of each frame that every layer has.
/// @param chosen  frame numbers to draw; empty: all
void fill_frames(DrawnScene& drawn, const std::vector<double>& chosen, const Warn& warn);

/// Cameras that look at the subject: one, or one per frame of a turntable.
std::vector<Camera> subject_cameras(const DrawnScene& drawn, const View& view, bool turn,
                                    const PictureOptions& picture);

/// Frames a second of the sequences, 0 where none has a rate. Throws DataError where two differ:
/// frames of one number would then be of different times.
double scene_frame_rate(const DrawnScene& drawn);

}  // namespace atelier
