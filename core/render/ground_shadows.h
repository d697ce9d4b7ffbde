#pragma once

#include <optional>
#include <vector>

#include "core/image.h"
#include "core/render/vector_math.h"

namespace atelier {

/// Light of the area lights at a point of the ground, and the part that meshes occlude.
struct GroundShadow {
  Vec3f open;     ///< irradiance with nothing in the way, linear RGB
  Vec3f missing;  ///< of that, what is blocked
};

/// The area lights' shadows on a square of the ground, gathered once for all cameras.
struct GroundShadows {
  float min_x = 0, min_z = 0;
  float cell = 0;            ///< metres
  Image open, missing;       ///< [points, points, 3], empty: not gathered
  std::vector<char> smooth;  ///< [points - 1, points - 1] cells between whose corners light runs
                             ///< straight enough; the others hold sharp shadows

  /// Bilinear; nothing outside the square and where shadows are sharp.
  std::optional<GroundShadow> at(float x, float z) const;
};

}  // namespace atelier
