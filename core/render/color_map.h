#pragma once

#include <Eigen/Core>
#include <string>

#include "core/image.h"
#include "core/types.h"

namespace atelier {

/// How numbers become colours.
enum class ColorMap {
  Viridis,    ///< even steps look even, also in grey: amounts
  Turbo,      ///< many hues: where small differences must show
  Diverging,  ///< blue, white, red: signed numbers about the middle
};

/// Linear RGB of t in [0,1] (clamped); grey for NaN.
Eigen::Vector3f map_color(ColorMap map, double t);

/// One colour per value, `low` to `high`, for Mesh::colors. Throws LogicError unless low < high.
Colors map_colors(ColorMap map, const Eigen::VectorXd& values, double low, double high);

/// A vertical bar of the map with `low`, the middle and `high` written beside it, and what they
/// are ("strain", "mm") above. Linear RGB on white. Throws LogicError unless low < high and the
/// height is at least 60.
Image color_bar(ColorMap map, double low, double high, const std::string& label, int height = 400);

}  // namespace atelier
