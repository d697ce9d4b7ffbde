#pragma once

#include <string>
#include <vector>

#include "appearance/learnt_occlusion.h"
#include "core/archive.h"
#include "core/camera.h"
#include "core/options.h"
#include "core/types.h"

namespace atelier {

struct PaintOptions {
  int samples = 2;  ///< a side of a pixel, 1..8: its square are averaged; 1 is quickest
  bool alpha = false;
  std::vector<double> background = {0.9, 0.9, 0.9};  ///< linear RGB behind everything
  OcclusionOptions occlusion = kOpenOcclusion;       ///< as the networks learnt, which it may not
                                                     ///< contradict
};
OptionTable describe(PaintOptions& options);

/// A surface that is to be drawn.
struct SceneLayer {
  std::string name;
  std::string model;                           ///< file of the network that draws it; "": `color`
  Eigen::Vector3f color{0.45F, 0.45F, 0.45F};  ///< linear RGB, times its ambient visibility
  Triangles faces;                             ///< of its vertices
  /// [V] of a body 1: lies over what is worn, as long hair does, and is not tucked under it. Empty:
  /// nothing does. Not in the archive.
  std::vector<char> over = {};
};

/// A scene to render, for a program that has neither capture nor workspace: surfaces over time and
/// cameras.
struct PaintedScene {
  std::vector<SceneLayer> layers;
  std::vector<Camera> cameras;                ///< one for all frames, or one for each
  std::vector<int> frame_ids;                 ///< [N]
  std::vector<std::vector<Points>> vertices;  ///< [N] of each layer; no rows: not worn
};

/// Archive of schema "atelier.painted_scene", version 1 (docs/reference/formats.md), and back;
/// vertices and colours as float. Reading throws DataError for arrays that are missing, of another
/// shape, not finite or out of range. Throws LogicError where the parts do not agree.
Archive archive_of(const PaintedScene& scene);
PaintedScene painted_scene_of(const Archive& archive, const std::string& file = "");

}  // namespace atelier
