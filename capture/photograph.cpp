#include "capture/photograph.h"

#include <cmath>

namespace atelier {

Scene scene_of(const StageInstant& instant) {
  Scene scene = instant.surroundings;
  std::vector<RenderMesh> meshes;
  meshes.reserve(instant.layers.size() + scene.meshes.size());
  for (const StageLayer& layer : instant.layers) {
    meshes.push_back(layer.mesh);
  }
  meshes.insert(meshes.end(), scene.meshes.begin(), scene.meshes.end());
  scene.meshes = std::move(meshes);
  return scene;
}

ByteImage label_image(const StageInstant& instant, const SurfaceMaps& maps) {
  ByteImage labels(maps.mesh.width, maps.mesh.height, 1,
                   static_cast<std::uint8_t>(Label::Background));
  for (std::size_t p = 0; p < labels.data.size(); ++p) {
    const int m = maps.mesh.data[p];
    if (m < 0 || static_cast<std::size_t>(m) >= instant.layers.size()) {
      continue;
    }
    const StageLayer& layer = instant.layers[static_cast<std::size_t>(m)];
    labels.data[p] = static_cast<std::uint8_t>(layer.label);
    const Mesh& mesh = layer.mesh.mesh;
    if (!mesh.labels.empty()) {
      int nearest = 0;
      for (int c = 1; c < 3; ++c) {
        if (maps.barycentric.data[3 * p + static_cast<std::size_t>(c)] >
            maps.barycentric.data[3 * p + static_cast<std::size_t>(nearest)]) {
          nearest = c;
        }
      }
      labels.data[p] =
          mesh.labels[static_cast<std::size_t>(mesh.faces(maps.face.data[p], nearest))];
    }
  }
  return labels;
}

Photograph photograph(const StageInstant& instant, const PreparedScene& prepared,
                      const Camera& camera, const RenderOptions& options) {
  Photograph result;
  result.light = render(prepared, camera, options);
  // Surroundings are background, also for depth.
  result.maps = surface_maps(prepared, camera, instant.layers.size());
  result.labels = label_image(instant, result.maps);
  return result;
}

}  // namespace atelier
