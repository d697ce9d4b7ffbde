#include "core/render/render.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "core/render/occupied_tiles.h"
#include "core/render/tile.h"

namespace atelier {

Image render(const PreparedScene& scene, const Camera& camera, const RenderOptions& options) {
  check_camera(camera);
  ATELIER_CHECK(options.samples >= 1 && options.samples <= 1024, "samples must lie in [1, 1024]");
  ATELIER_CHECK(options.shadow_samples >= 1 && options.shadow_samples <= 256,
                "shadow_samples must lie in [1, 256]");
  ATELIER_CHECK(options.penumbra_samples >= 0 && options.penumbra_samples <= 256,
                "penumbra_samples must lie in [0, 256]");
  ATELIER_CHECK(options.ambient_samples >= 1 && options.ambient_samples <= 1024,
                "ambient_samples must lie in [1, 1024]");
  Image image(camera.width, camera.height, options.alpha ? 4 : 3);
  const OccupiedTiles occupied =
      occupied_tiles(scene.data(), camera, kTile, scene.data().meshes.size());
  const auto count = static_cast<Index>(occupied.any.size());
  parallel_for(count, 4, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const auto column = static_cast<int>(i % occupied.columns);
      const auto line = static_cast<int>(i / occupied.columns);
      const int x0 = column * kTile;
      const int y0 = line * kTile;
      const Image tile =
          rendered_tile(scene.data(), camera, options, x0, y0, occupied.at(column, line));
      const auto row = static_cast<std::ptrdiff_t>(tile.width) * tile.channels;
      for (int y = 0; y < tile.height; ++y) {
        std::copy_n(tile.data.begin() + y * row, row, &image.at(x0, y0 + y));
      }
    }
  });
  return image;
}

Image render(const Scene& scene, const Camera& camera, const RenderOptions& options) {
  return render(prepare(scene), camera, options);
}

}  // namespace atelier
