#pragma once

#include <vector>

#include "capture/label_taxonomy.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/render/render.h"
#include "core/render/scene.h"
#include "core/render/surface_maps.h"

namespace atelier {

/// One mesh before the cameras, and what it is.
struct StageLayer {
  std::string name;  ///< "body", "hair", "shoes", the garment's name
  RenderMesh mesh;   ///< with labels per vertex, these win over `label`
  Label label = Label::Unknown;
};

/// One instant of a capture: everything that cameras see.
struct StageInstant {
  std::vector<StageLayer> layers;
  Scene surroundings;  ///< lights, ground, background, and meshes that are background
};

/// Everything before the cameras as a scene: the layers come first, in their order.
Scene scene_of(const StageInstant& instant);

/// The true label of each pixel: of the layer whose surface its centre sees, by the nearest vertex
/// where the layer has labels per vertex; the surroundings are Background.
ByteImage label_image(const StageInstant& instant, const SurfaceMaps& maps);

/// A camera's image of an instant, without noise: linear light (before exposure and gain), the true
/// labels and the surface maps.
struct Photograph {
  Image light;       ///< [H,W,3] linear RGB
  ByteImage labels;  ///< [H,W] Label
  SurfaceMaps maps;  ///< of layers alone: surroundings are -1
};

/// Takes it. `prepared` is of scene_of(instant). Throws as render does.
Photograph photograph(const StageInstant& instant, const PreparedScene& prepared,
                      const Camera& camera, const RenderOptions& options = {});

}  // namespace atelier
