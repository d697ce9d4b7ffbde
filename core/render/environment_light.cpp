#include "core/render/environment_light.h"

#include <numbers>

#include "core/parallel.h"
#include "core/render/reflectance.h"
#include "core/saturating_cast.h"

namespace atelier {

namespace {

constexpr int kLevels = 6;
constexpr int kRows = 33;
constexpr int kColumns = 64;
constexpr std::uint32_t kLobeSamples = 256;
constexpr std::uint32_t kIrradianceSamples = 4096;

// Column and row in [0,1) of a direction: the middle looks to -Z, +X lies right of it, +Y on top.
Point2f equirectangular(Vec3f d) {
  return {0.5f + std::atan2(d.x, -d.z) / (2 * std::numbers::pi_v<float>),
          std::acos(std::clamp(d.y, -1.0f, 1.0f)) / std::numbers::pi_v<float>};
}

Vec3f image_radiance(const Image& image, Vec3f d) {
  const Point2f p = equirectangular(d);
  const float x = p.x * static_cast<float>(image.width) - 0.5f;
  const float y = p.y * static_cast<float>(image.height) - 0.5f;
  const int xf = saturating_cast<int>(std::floor(x));
  const int yf = saturating_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(xf);
  const float fy = y - static_cast<float>(yf);
  const auto texel = [&](int i, int j) {
    i = (i % image.width + image.width) % image.width;
    j = std::clamp(j, 0, image.height - 1);
    const float* t = &image.at(i, j);
    return Vec3f{t[0], t[1], t[2]};
  };
  return mix(mix(texel(xf, yf), texel(xf + 1, yf), fx),
             mix(texel(xf, yf + 1), texel(xf + 1, yf + 1), fx), fy);
}

// Brightness over cells of equal solid angle (columns in azimuth, rows in height y).
void fill_cells(EnvironmentLight& light) {
  const Image& image = *light.source.image;
  light.cell_columns = std::clamp(image.width, 4, 128);
  light.cell_rows = std::clamp(image.height, 4, 64);
  double sum = 0;
  for (int r = 0; r < light.cell_rows; ++r) {
    for (int c = 0; c < light.cell_columns; ++c) {
      double cell = 0;
      constexpr int kSub = 4;
      for (int s = 0; s < kSub * kSub; ++s) {
        const float u = (static_cast<float>(c) + (static_cast<float>(s % kSub) + 0.5f) / kSub) /
                        static_cast<float>(light.cell_columns);
        const float v = (static_cast<float>(r) + (static_cast<float>(s / kSub) + 0.5f) / kSub) /
                        static_cast<float>(light.cell_rows);
        const float y = 1 - 2 * v;
        const float a = 2 * std::numbers::pi_v<float> * (u - 0.5f);
        const float h = std::sqrt(std::max(0.0f, 1 - y * y));
        cell += luminance(radiance(light, {h * std::sin(a), y, -h * std::cos(a)})) + 1e-6f;
      }
      sum += cell;
      light.cumulative.push_back(static_cast<float>(sum));
    }
  }
  for (float& value : light.cumulative) {
    value = static_cast<float>(value / sum);
  }
  light.cumulative.back() = 1;
}

int cell_of(const EnvironmentLight& light, Vec3f d) {
  const float u = 0.5f + std::atan2(d.x, -d.z) / (2 * std::numbers::pi_v<float>);
  const float v = 0.5f * (1 - d.y);
  const int c = std::clamp(saturating_cast<int>(u * static_cast<float>(light.cell_columns)), 0,
                           light.cell_columns - 1);
  const int r = std::clamp(saturating_cast<int>(v * static_cast<float>(light.cell_rows)), 0,
                           light.cell_rows - 1);
  return r * light.cell_columns + c;
}

float cell_share(const EnvironmentLight& light, int cell) {
  return light.cumulative[cell] - (cell > 0 ? light.cumulative[cell - 1] : 0.0f);
}

float brightness_density(const EnvironmentLight& light, Vec3f d) {
  const float cells = static_cast<float>(light.cumulative.size());
  return cell_share(light, cell_of(light, d)) * cells / (4 * std::numbers::pi_v<float>);
}

Vec3f lobe_mean(const EnvironmentLight& light, Vec3f direction, float roughness) {
  const Frame frame(direction);
  Vec3f sum{0, 0, 0};
  float weight = 0;
  for (std::uint32_t i = 0; i < kLobeSamples; ++i) {
    const Vec3f h = gloss_half_vector(sobol_point(i, 3), roughness);
    const Vec3f l{2 * h.z * h.x, 2 * h.z * h.y, 2 * h.z * h.z - 1};  // of a view along the normal
    if (l.z > 0) {
      sum += l.z * radiance(light, frame.world(l));
      weight += l.z;
    }
  }
  return (1 / weight) * sum;
}

}  // namespace

EnvironmentLight environment_light(const Environment& environment,
                                   const std::optional<Vec3f>& ground_radiance) {
  EnvironmentLight light;
  light.source = environment;
  light.ground_radiance = ground_radiance;
  if (environment.image) {
    fill_cells(light);
  }
  const int columns = environment.image ? kColumns : 1;
  for (int level = 0; level < kLevels; ++level) {
    const float roughness = static_cast<float>(level) / (kLevels - 1);
    Image table(columns, kRows, 3);
    parallel_for(kRows, 1, [&](Index begin, Index end) {
      for (int r = static_cast<int>(begin); r < end; ++r) {
        const float y = 1 - 2 * static_cast<float>(r) / (kRows - 1);
        const float h = std::sqrt(std::max(0.0f, 1 - y * y));
        for (int c = 0; c < columns; ++c) {
          const float a = 2 * std::numbers::pi_v<float> *
                          ((static_cast<float>(c) + 0.5f) / static_cast<float>(columns) - 0.5f);
          const Vec3f d{h * std::sin(a), y, -h * std::cos(a)};
          const Vec3f value = level == 0 ? radiance(light, d) : lobe_mean(light, d, roughness);
          table.at(c, r, 0) = value.x;
          table.at(c, r, 1) = value.y;
          table.at(c, r, 2) = value.z;
        }
      }
    });
    light.glossy.push_back(std::move(table));
  }
  return light;
}

Vec3f source_radiance(const Environment& environment, Vec3f direction) {
  if (environment.image) {
    return environment.image_scale * image_radiance(*environment.image, direction);
  }
  const Vec3f pole = vec3f(direction.y >= 0 ? environment.zenith : environment.nadir);
  return mix(vec3f(environment.horizon), pole, std::min(1.0f, std::abs(direction.y)));
}

Vec3f radiance(const EnvironmentLight& light, Vec3f direction) {
  if (light.ground_radiance && direction.y < 0) {
    return *light.ground_radiance;
  }
  return source_radiance(light.source, direction);
}

Vec3f glossy_radiance(const EnvironmentLight& light, Vec3f direction, float roughness) {
  const float level = std::clamp(roughness, 0.0f, 1.0f) * (kLevels - 1);
  const int l0 = std::min(saturating_cast<int>(level), kLevels - 2);
  const float fl = level - static_cast<float>(l0);
  const float row = 0.5f * (1 - std::clamp(direction.y, -1.0f, 1.0f)) * (kRows - 1);
  const int r0 = std::min(saturating_cast<int>(row), kRows - 2);
  const float fr = row - static_cast<float>(r0);
  const auto read = [&](const Image& table, int c, int r) {
    const float* t = &table.at(c, r);
    return Vec3f{t[0], t[1], t[2]};
  };
  const auto level_value = [&](const Image& table) {
    if (table.width == 1) {
      return mix(read(table, 0, r0), read(table, 0, r0 + 1), fr);
    }
    const float x =
        (0.5f + std::atan2(direction.x, -direction.z) / (2 * std::numbers::pi_v<float>)) *
            static_cast<float>(table.width) -
        0.5f;
    const float x_floor = std::floor(x);
    const float fx = x - x_floor;
    const int c0 = (saturating_cast<int>(x_floor) + table.width) % table.width;
    const int c1 = (c0 + 1) % table.width;
    return mix(mix(read(table, c0, r0), read(table, c1, r0), fx),
               mix(read(table, c0, r0 + 1), read(table, c1, r0 + 1), fx), fr);
  };
  return mix(level_value(light.glossy[l0]), level_value(light.glossy[l0 + 1]), fl);
}

Vec3f open_irradiance(const EnvironmentLight& light, Vec3f normal) {
  const Frame frame(normal);
  double sum[3] = {0, 0, 0};
  for (std::uint32_t i = 0; i < kIrradianceSamples; ++i) {
    const EnvironmentSample s = sample_environment(light, frame, i, 4);
    if (s.weight > 0) {
      const Vec3f value = s.weight * radiance(light, s.direction);
      sum[0] += value.x;
      sum[1] += value.y;
      sum[2] += value.z;
    }
  }
  return {static_cast<float>(sum[0] / kIrradianceSamples),
          static_cast<float>(sum[1] / kIrradianceSamples),
          static_cast<float>(sum[2] / kIrradianceSamples)};
}

EnvironmentSample sample_environment(const EnvironmentLight& light, const Frame& frame,
                                     std::uint32_t index, std::uint32_t seed) {
  if (light.cumulative.empty()) {
    return {frame.world(cosine_direction(sobol_point(index, seed))), std::numbers::pi_v<float>};
  }
  Vec3f direction{0, 0, 0};
  const bool by_cosine = index % 2 == 0;
  const Point2f u = sobol_point(index / 2, by_cosine ? seed : seed ^ 0x5BD1E995u);
  if (by_cosine) {
    direction = frame.world(cosine_direction(u));
  } else {
    const auto found = std::upper_bound(light.cumulative.begin(), light.cumulative.end() - 1, u.x);
    const int cell = static_cast<int>(found - light.cumulative.begin());
    const float low = cell > 0 ? light.cumulative[cell - 1] : 0.0f;
    // The remainder of the first number places the point along the cell's azimuth.
    const float rest =
        std::clamp((u.x - low) / std::max(1e-12f, cell_share(light, cell)), 0.0f, 1.0f);
    const int row = cell / light.cell_columns;
    const int column = cell % light.cell_columns;
    const float a =
        2 * std::numbers::pi_v<float> *
        ((static_cast<float>(column) + rest) / static_cast<float>(light.cell_columns) - 0.5f);
    const float y = 1 - 2 * (static_cast<float>(row) + u.y) / static_cast<float>(light.cell_rows);
    const float h = std::sqrt(std::max(0.0f, 1 - y * y));
    direction = {h * std::sin(a), y, -h * std::cos(a)};
  }
  const float cosine = dot(direction, frame.n);
  if (cosine <= 0) {
    return {direction, 0};
  }
  return {direction, cosine / (0.5f * cosine / std::numbers::pi_v<float> +
                               0.5f * brightness_density(light, direction))};
}

}  // namespace atelier
