#pragma once

#include <vector>

#include "core/camera.h"
#include "core/render/prepared_scene.h"

namespace atelier {

/// Which squares of an image, `side` pixels wide, a mesh may touch.
struct OccupiedTiles {
  int columns = 0;
  int rows = 0;
  std::vector<char> any;  ///< [rows, columns], 0: no mesh is seen there

  bool at(int column, int row) const {
    return any[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(column)] != 0;
  }
};

/// Of the scene's first `meshes`: boxes about the projected triangles, grown by what a lens bends
/// their edges. All squares where a triangle reaches from what the image shows to behind the
/// camera or beyond the lens. Private to core/render.
OccupiedTiles occupied_tiles(const PreparedScene::Data& scene, const Camera& camera, int side,
                             std::size_t meshes);

}  // namespace atelier
