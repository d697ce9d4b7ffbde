#include "core/render/reflectance.h"

#include <array>
#include <numbers>

#include "core/saturating_cast.h"

namespace atelier {

namespace {

constexpr int kCosines = 32;
constexpr int kRoughnesses = 16;
constexpr std::uint32_t kQuadrature = 1024;
constexpr float kSheenRoughness = 0.5f;

struct Tables {
  std::array<std::array<GlossAlbedo, kCosines>, kRoughnesses> gloss;
  std::array<float, kCosines> sheen;
};

// The cosine of table column i; the first stays off zero, where nothing is defined.
float column_cosine(int i) {
  return std::max(1e-3f, static_cast<float>(i) / (kCosines - 1));
}

// Trowbridge and Reitz's distribution; a2 is the fourth power of the roughness.
float distribution(float n_dot_h, float a2) {
  const float d = (a2 - 1) * n_dot_h * n_dot_h + 1;
  return a2 / (std::numbers::pi_v<float> * d * d);
}

GlossAlbedo integrate_gloss(float n_dot_v, float roughness) {
  const Vec3f v{std::sqrt(std::max(0.0f, 1 - n_dot_v * n_dot_v)), 0, n_dot_v};
  double scale = 0;
  double bias = 0;
  for (std::uint32_t i = 0; i < kQuadrature; ++i) {
    // Half vectors by the distribution itself: the integrand becomes smooth.
    const Vec3f h = gloss_half_vector(sobol_point(i, 1), roughness);
    const float v_dot_h = dot(v, h);
    const float n_dot_l = 2 * v_dot_h * h.z - v.z;
    if (n_dot_l <= 0 || v_dot_h <= 0) {
      continue;
    }
    const float weight = ggx(n_dot_v, n_dot_l, h.z, roughness) * n_dot_l /
                         std::max(1e-12f, gloss_density(h.z, v_dot_h, roughness));
    const float w = fresnel_weight(v_dot_h);
    scale += weight * (1 - w);
    bias += weight * w;
  }
  return {static_cast<float>(scale / kQuadrature), static_cast<float>(bias / kQuadrature)};
}

float integrate_sheen(float n_dot_v) {
  const Vec3f v{std::sqrt(std::max(0.0f, 1 - n_dot_v * n_dot_v)), 0, n_dot_v};
  double sum = 0;
  for (std::uint32_t i = 0; i < kQuadrature; ++i) {
    const Vec3f l = cosine_direction(sobol_point(i, 2));
    if (l.z <= 0) {
      continue;
    }
    sum += std::numbers::pi_v<float> * sheen(n_dot_v, l.z, normalized(v + l).z);
  }
  return static_cast<float>(std::min(1.0, sum / kQuadrature));
}

const Tables& tables() {
  static const Tables filled = [] {
    Tables t{};
    for (int r = 0; r < kRoughnesses; ++r) {
      const float roughness = std::max(0.05f, static_cast<float>(r) / (kRoughnesses - 1));
      for (int c = 0; c < kCosines; ++c) {
        t.gloss[r][c] = integrate_gloss(column_cosine(c), roughness);
      }
    }
    for (int c = 0; c < kCosines; ++c) {
      t.sheen[c] = integrate_sheen(column_cosine(c));
    }
    return t;
  }();
  return filled;
}

}  // namespace

float ggx(float n_dot_v, float n_dot_l, float n_dot_h, float roughness) {
  const float a2 = roughness * roughness * roughness * roughness;
  const float masking = n_dot_l * std::sqrt(n_dot_v * n_dot_v * (1 - a2) + a2);
  const float shadowing = n_dot_v * std::sqrt(n_dot_l * n_dot_l * (1 - a2) + a2);
  return distribution(n_dot_h, a2) * 0.5f / std::max(1e-7f, masking + shadowing);
}

Vec3f gloss_half_vector(Point2f u, float roughness) {
  const float a2 = roughness * roughness * roughness * roughness;
  const float cos_h = std::sqrt((1 - u.x) / (1 + (a2 - 1) * u.x));
  const float sin_h = std::sqrt(std::max(0.0f, 1 - cos_h * cos_h));
  const float phi = 2 * std::numbers::pi_v<float> * u.y;
  return {sin_h * std::cos(phi), sin_h * std::sin(phi), cos_h};
}

float gloss_density(float n_dot_h, float v_dot_h, float roughness) {
  const float a2 = roughness * roughness * roughness * roughness;
  return distribution(n_dot_h, a2) * n_dot_h / (4 * std::max(1e-6f, v_dot_h));
}

float fresnel_weight(float v_dot_h) {
  const float x = std::clamp(1 - v_dot_h, 0.0f, 1.0f);
  const float x2 = x * x;
  return x2 * x2 * x;
}

GlossAlbedo gloss_albedo(float n_dot_v, float roughness) {
  const float c = std::clamp(n_dot_v, 0.0f, 1.0f) * (kCosines - 1);
  const float r = std::clamp(roughness, 0.0f, 1.0f) * (kRoughnesses - 1);
  const int c0 = std::min(saturating_cast<int>(c), kCosines - 2);
  const int r0 = std::min(saturating_cast<int>(r), kRoughnesses - 2);
  const float fc = c - static_cast<float>(c0);
  const float fr = r - static_cast<float>(r0);
  const auto& table = tables().gloss;
  const auto blend = [&](float GlossAlbedo::*member) {
    const float low = (1 - fc) * table[r0][c0].*member + fc * table[r0][c0 + 1].*member;
    const float high = (1 - fc) * table[r0 + 1][c0].*member + fc * table[r0 + 1][c0 + 1].*member;
    return (1 - fr) * low + fr * high;
  };
  return {blend(&GlossAlbedo::scale), blend(&GlossAlbedo::bias)};
}

float sheen(float n_dot_v, float n_dot_l, float n_dot_h) {
  constexpr float kInverse = 1 / kSheenRoughness;
  const float sin2 = std::max(0.0f, 1 - n_dot_h * n_dot_h);
  static_assert(kInverse == 2.0f, "pow(sin, 1/roughness) is written as sin^2 below");
  const float density = (2 + kInverse) * sin2 / (2 * std::numbers::pi_v<float>);
  return density / (4 * std::max(1e-4f, n_dot_l + n_dot_v - n_dot_l * n_dot_v));
}

float sheen_albedo(float n_dot_v) {
  const float c = std::clamp(n_dot_v, 0.0f, 1.0f) * (kCosines - 1);
  const int c0 = std::min(saturating_cast<int>(c), kCosines - 2);
  const float f = c - static_cast<float>(c0);
  const auto& table = tables().sheen;
  return (1 - f) * table[c0] + f * table[c0 + 1];
}

void prepare_reflectance_tables() {
  tables();
}

}  // namespace atelier
