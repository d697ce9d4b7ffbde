#pragma once

#include <memory>

#include "core/image.h"
#include "core/types.h"

namespace atelier {

/// A rectangle that shines to the side of `half_u x half_v`; the camera does not see it.
struct AreaLight {
  Eigen::Vector3d center{0, 3, 2};    ///< metres
  Eigen::Vector3d half_u{0.5, 0, 0};  ///< metres, from the centre to the middle of one side
  Eigen::Vector3d half_v{0, 0, 0.5};  ///< metres, to the middle of the next side; orthogonal to u
  Eigen::Vector3f radiance{1, 1, 1};  ///< linear RGB; irradiance = radiance x pi x form factor
};

/// Light from infinitely far: an image if there is one, else a vertical gradient.
struct Environment {
  Eigen::Vector3f zenith{0, 0, 0};   ///< radiance from straight above, linear RGB
  Eigen::Vector3f horizon{0, 0, 0};  ///< from the horizon
  Eigen::Vector3f nadir{0, 0, 0};    ///< from straight below
  /// Equirectangular radiance, linear RGB: the middle column looks to -Z, a quarter right of it to
  /// +X, the top row up. Takes the gradient's place.
  std::shared_ptr<const Image> image;
  float image_scale = 1.0f;  ///< factor on the image
};

}  // namespace atelier
