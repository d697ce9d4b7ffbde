#include "core/render/rectangle_light.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace atelier {

namespace {

// angle / sin(angle) for the cosine of an angle: the Chebyshev fit of degree 9 on [0, 1], off by at
// most 2e-8 there, and the plain quotient beyond the right angle.
float angle_over_sine(float c) {
  if (c < 0) {
    const float s2 = 1 - c * c;
    return s2 > 1e-12f ? std::acos(c) / std::sqrt(s2) : 0.0f;
  }
  constexpr std::array<float, 10> kFit{1.5707963097f, -0.9999964366f, 0.7852742985f, -0.6649706907f,
                                       0.5769827092f, -0.4822302955f, 0.3510927209f, -0.1947476261f,
                                       0.0692690926f, -0.0114700943f};
  float value = kFit[9];
  for (int i = 8; i >= 0; --i) {
    value = value * c + kFit[static_cast<std::size_t>(i)];
  }
  return value;
}

// One edge's share of 2 pi times the form factor: the angle between the unit directions to its ends
// times the normal's component along their common perpendicular.
float edge_term(Vec3f a, Vec3f b, Vec3f normal) {
  return angle_over_sine(std::clamp(dot(a, b), -1.0f, 1.0f)) * dot(cross(a, b), normal);
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

float distance_to(const RectangleLight& light, Vec3f origin, Vec3f direction) {
  const float towards = -dot(direction, light.normal);
  if (towards <= 0) {
    return 0;
  }
  const float distance = dot(origin - light.center, light.normal) / towards;
  const Vec3f p = origin + distance * direction - light.center;
  const bool inside = std::abs(dot(p, light.half_u)) <= squared_norm(light.half_u) &&
                      std::abs(dot(p, light.half_v)) <= squared_norm(light.half_v);
  return inside ? std::max(0.0f, distance) : 0.0f;
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
  std::array<Vec3f, 6> seen{};
  int count = 4;
  if (above == 4) {
    std::copy(corners.begin(), corners.end(), seen.begin());
  } else {
    // Sutherland-Hodgman at the horizon: a quadrilateral becomes at most a pentagon, whose new
    // edge within the horizon counts like the others.
    count = 0;
    for (int i = 0; i < 4; ++i) {
      const int j = (i + 1) % 4;
      if (height[i] > 0) {
        seen[count++] = corners[i];
      }
      if ((height[i] > 0) != (height[j] > 0)) {
        seen[count++] = mix(corners[i], corners[j], height[i] / (height[i] - height[j]));
      }
    }
  }
  for (int i = 0; i < count; ++i) {
    seen[i] = normalized(seen[i]);
  }
  float sum = 0;
  for (int i = 0; i < count; ++i) {
    sum += edge_term(seen[i], seen[i + 1 == count ? 0 : i + 1], normal);
  }
  // The rectangle turns its front to the point, so its corners run clockwise as seen from there.
  const float value = -sum / (2 * std::numbers::pi_v<float>);
  return {std::clamp(value, 0.0f, 1.0f), above == 4};
}

}  // namespace atelier
