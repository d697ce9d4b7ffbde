#pragma once

#include <functional>
#include <vector>

#include "core/mesh.h"
#include "registration/template/body_anatomy.h"

namespace atelier {

/// A clothed person at one instant.
struct ClothedFrame {
  Mesh scan;    ///< labelled surface, triangles counter-clockwise from outside
  Points body;  ///< [V,3] m, vertices of the body under the clothes
};

/// Frames of a clothed person, loaded when asked for.
struct ClothedFrames {
  Triangles body_faces;
  BodyAnatomy anatomy;
  std::vector<int> frame_ids;
  std::function<ClothedFrame(Index frame_idx)> load;
};

}  // namespace atelier
