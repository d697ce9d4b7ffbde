#include "core/render/rectangle_light.h"

#include <array>
#include <numbers>

namespace atelier {

namespace {

// Contribution of one edge to 2 pi times the form factor: angle between the directions times the
// normal's component along their common perpendicular.
float edge_term(Vec3f a, Vec3f b, Vec3f normal) {
  const Vec3f c = cross(a, b);
  const float s = norm(c);  // |a||b| sin
  const float d = dot(a, b);
  if (s <= 1e-12f * std::abs(d) || s == 0) {
    return 0;
  }
  return std::atan2(s, d) * dot(c, normal) / s;
}

}  // namespace

RectangleLight rectangle_light(const AreaLight& light) {
  RectangleLight r{};
  r.center = vec3f(light.center);
  r.half_u = vec3f(light.half_u);
  r.half_v = vec3f(light.half_v);
  const Vec3f c = cross(r.half_u, r.half_v);
  r.normal = normalized(c);
  r.radiance = vec3f(light.radiance);
  r.area = 4 * norm(c);
  return r;
}

FormFactor form_factor(const RectangleLight& light, Vec3f point, Vec3f normal) {
  if (dot(point - light.center, light.normal) <= 0) {
    return {0, false};
  }
  const Vec3f c = light.center - point;
  const std::array<Vec3f, 4> corners{
      c - light.half_u - light.half_v, c + light.half_u - light.half_v,
      c + light.half_u + light.half_v, c - light.half_u + light.half_v};
  std::array<float, 4> height{};
  int above = 0;
  for (int i = 0; i < 4; ++i) {
    height[i] = dot(corners[i], normal);
    above += height[i] > 0 ? 1 : 0;
  }
  if (above == 0) {
    return {0, false};
  }
  float sum = 0;
  if (above == 4) {
    for (int i = 0; i < 4; ++i) {
      sum += edge_term(corners[i], corners[(i + 1) % 4], normal);
    }
  } else {
    // Sutherland-Hodgman at the horizon: a quadrilateral becomes at most a pentagon, whose new
    // edge within the horizon counts like the others.
    std::array<Vec3f, 6> clipped{};
    int count = 0;
    for (int i = 0; i < 4; ++i) {
      const int j = (i + 1) % 4;
      if (height[i] > 0) {
        clipped[count++] = corners[i];
      }
      if ((height[i] > 0) != (height[j] > 0)) {
        clipped[count++] = mix(corners[i], corners[j], height[i] / (height[i] - height[j]));
      }
    }
    for (int i = 0; i < count; ++i) {
      sum += edge_term(clipped[i], clipped[(i + 1) % count], normal);
    }
  }
  // The rectangle turns its front to the point, so its corners run clockwise as seen from there.
  const float value = -sum / (2 * std::numbers::pi_v<float>);
  return {std::clamp(value, 0.0f, 1.0f), above == 4};
}

}  // namespace atelier
