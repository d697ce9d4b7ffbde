#include "core/render/render.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "core/render/tile.h"

namespace atelier {

namespace {

// Which tiles a mesh may touch: boxes about the projected triangles, grown by what a lens bends
// their edges. All of them where a triangle reaches behind the camera or beyond the lens.
std::vector<char> occupied_tiles(const PreparedScene::Data& scene, const Camera& camera,
                                 int columns, int rows) {
  std::vector<char> tiles(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  const double bend = camera.distortion_model == Distortion::None ? 0 : 0.15;
  std::vector<std::optional<Eigen::Vector2d>> pixels;
  for (const PreparedMesh& mesh : scene.meshes) {
    pixels.assign(mesh.positions.size() / 3, std::nullopt);
    parallel_for(static_cast<Index>(pixels.size()), 1024, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const Vec3f p = mesh.position(static_cast<std::uint32_t>(i));
        pixels[static_cast<std::size_t>(i)] = project(camera, Eigen::Vector3d(p.x, p.y, p.z));
      }
    });
    for (std::size_t f = 0; f < mesh.indices.size(); f += 3) {
      const auto& a = pixels[mesh.indices[f]];
      const auto& b = pixels[mesh.indices[f + 1]];
      const auto& c = pixels[mesh.indices[f + 2]];
      if (!a || !b || !c) {
        tiles.assign(tiles.size(), 1);
        return tiles;
      }
      const Eigen::Vector2d low = a->cwiseMin(*b).cwiseMin(*c);
      const Eigen::Vector2d high = a->cwiseMax(*b).cwiseMax(*c);
      const double margin = 1 + bend * (high - low).maxCoeff();
      const auto tile = [](double pixel, int last) {
        return static_cast<int>(std::floor(std::clamp(pixel / kTile, -1.0, last + 1.0)));
      };
      for (int y = std::max(0, tile(low.y() - margin, rows));
           y <= std::min(rows - 1, tile(high.y() + margin, rows)); ++y) {
        for (int x = std::max(0, tile(low.x() - margin, columns));
             x <= std::min(columns - 1, tile(high.x() + margin, columns)); ++x) {
          tiles[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(x)] = 1;
        }
      }
    }
  }
  return tiles;
}

}  // namespace

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
  const int columns = (camera.width + kTile - 1) / kTile;
  const int rows = (camera.height + kTile - 1) / kTile;
  const std::vector<char> occupied = occupied_tiles(scene.data(), camera, columns, rows);
  parallel_for(static_cast<Index>(columns) * rows, 4, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const int x0 = static_cast<int>(i % columns) * kTile;
      const int y0 = static_cast<int>(i / columns) * kTile;
      const Image tile = rendered_tile(scene.data(), camera, options, x0, y0,
                                       occupied[static_cast<std::size_t>(i)] != 0);
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
