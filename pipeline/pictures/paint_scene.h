#pragma once

#include <functional>
#include <string>

#include "appearance/joined_surfaces.h"
#include "appearance/painted_scene.h"
#include "core/device.h"

namespace atelier {

/// Callbacks for the images of a scene, in the order of its frames. All may be empty.
struct PaintHooks {
  /// [H,W,4] linear light; the fourth channel is 1, or with `alpha` the coverage, the colour then
  /// premultiplied.
  std::function<void(Index frame_idx, const Image& picture)> picture;
  std::function<bool()> stop;
};

/// Skin under the cloth that is worn over it (appearance/remove_penetration.h, up to 3 cm), but for
/// what lies over cloth. @param over  SceneLayer::over
Points tucked_skin(const Points& skin, const Triangles& faces, const JoinedSurfaces& cloth,
                   const std::vector<char>& over);

/// Draws every frame of a scene, each garment and the body by its network (`SceneLayer::model`, the
/// <name>/model.safetensors of the stage `appearance`), composed by depth; skin that stands out
/// of cloth is tucked under it first (appearance/remove_penetration.h). The program
/// `atelier-appearance` works beside this one; images are handed out as they come, and it waits
/// where nobody takes them, so that no more than four are on the disk. True if all were drawn,
/// false if it was stopped.
///
/// Throws DataError for a network of other faces than its layer's, EnvironmentError where the
/// program or the device is not there.
bool paint_scene(const PaintedScene& scene, const PaintOptions& options, Device device,
                 const PaintHooks& hooks);

/// The scene as it is drawn: with its body under what it wears, by up to 3 cm.
PaintedScene without_penetration(PaintedScene scene);

}  // namespace atelier
