#include "appearance/visible_pixels.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

/// 1 where a pixel and its right and lower neighbours are of the surface, without a jump.
ByteImage sound_pixels(const Raster& raster, int first_face, int end_face, double jump) {
  const int width = raster.face.width;
  const int height = raster.face.height;
  ByteImage sound(width, height, 1, 0);
  const auto of_surface = [&](int x, int y) {
    const int face = raster.face.at(x, y);
    return face >= first_face && face < end_face;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      bool good = of_surface(x, y);
      for (const auto& [dx, dy] :
           {std::pair{1, 0}, std::pair{0, 1}, std::pair{-1, 0}, std::pair{0, -1}}) {
        const int nx = x + dx;
        const int ny = y + dy;
        if (good && nx >= 0 && ny >= 0 && nx < width && ny < height && of_surface(nx, ny)) {
          good = std::abs(raster.depth.at(nx, ny) - raster.depth.at(x, y)) <= jump;
        }
      }
      sound.at(x, y) = good ? 1 : 0;
    }
  }
  return sound;
}

/// Least value within `radius` pixels along rows, then columns; outside of the image is sound.
ByteImage eroded(const ByteImage& mask, int radius) {
  ByteImage rows(mask.width, mask.height, 1);
  ByteImage result(mask.width, mask.height, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      std::uint8_t least = 1;
      for (int k = std::max(0, x - radius); k <= std::min(mask.width - 1, x + radius); ++k) {
        least = std::min(least, mask.at(k, y));
      }
      rows.at(x, y) = least;
    }
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      std::uint8_t least = 1;
      for (int k = std::max(0, y - radius); k <= std::min(mask.height - 1, y + radius); ++k) {
        least = std::min(least, rows.at(x, k));
      }
      result.at(x, y) = least;
    }
  }
  return result;
}

}  // namespace

OptionTable describe(VisibleOptions& options) {
  OptionTable table;
  table.add("erosion", options.erosion, 0, 32, "px",
            "Width of the margin left out along silhouettes and depth discontinuities; more where "
            "geometry is inaccurate");
  table.add("depth_jump", options.depth_jump, 1e-6, 10, "m",
            "Minimum difference of depth between neighbouring pixels at a depth discontinuity");
  return table;
}

VisiblePixels visible_pixels(const Raster& raster, int first_face, const Points2& uvs,
                             const Triangles& uv_faces, const VisibleOptions& options) {
  ATELIER_CHECK(first_face >= 0, "a surface's first face is not negative");
  ATELIER_CHECK(
      uv_faces.rows() == 0 || (uv_faces.minCoeff() >= 0 && uv_faces.maxCoeff() < uvs.rows()),
      "a texture face names a coordinate that is not there");
  const int end_face = first_face + static_cast<int>(uv_faces.rows());
  const ByteImage trusted =
      eroded(sound_pixels(raster, first_face, end_face, options.depth_jump), options.erosion);
  VisiblePixels seen;
  for (std::size_t i = 0; i < raster.face.data.size(); ++i) {
    const int face = raster.face.data[i];
    if (face < first_face || face >= end_face) {
      continue;
    }
    Eigen::Vector2d uv(0, 0);
    for (int k = 0; k < 3; ++k) {
      uv += static_cast<double>(raster.barycentric.data[3 * i + static_cast<std::size_t>(k)]) *
            uvs.row(uv_faces(face - first_face, k)).transpose();
    }
    seen.pixel.push_back(static_cast<int>(i));
    seen.u.push_back(static_cast<float>(uv.x()));
    seen.v.push_back(static_cast<float>(uv.y()));
    seen.depth.push_back(raster.depth.data[i]);
    seen.trusted.push_back(static_cast<char>(trusted.data[i]));
  }
  return seen;
}

}  // namespace atelier
