#pragma once

#include "core/render/sampling.h"
#include "core/render/scene.h"
#include "core/render/vector_math.h"

namespace atelier {

/// An AreaLight in the numbers that shading needs.
struct RectangleLight {
  Vec3f center, half_u, half_v;
  Vec3f normal;  ///< unit, the side that shines
  Vec3f radiance;
  float area;  ///< square metres
};

RectangleLight rectangle_light(const AreaLight& light);

/// Form factor in [0,1] of the whole unblocked rectangle at a point with unit normal: irradiance is
/// pi x radiance x this. Lambert's closed form for polygons, clipped at the point's horizon.
/// `whole` says whether the rectangle lies wholly above the horizon.
struct FormFactor {
  float value;
  bool whole;
};
FormFactor form_factor(const RectangleLight& light, Vec3f point, Vec3f normal);

/// Distance along a ray to the shining side, 0 if it misses.
float distance_to(const RectangleLight& light, Vec3f origin, Vec3f direction);

/// Point of the rectangle.
inline Vec3f light_point(const RectangleLight& light, Point2f u) {
  return light.center + (2 * u.x - 1) * light.half_u + (2 * u.y - 1) * light.half_v;
}

}  // namespace atelier
