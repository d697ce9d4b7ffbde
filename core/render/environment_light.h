#pragma once

#include <optional>
#include <vector>

#include "core/render/sampling.h"
#include "core/render/scene.h"

namespace atelier {

/// An Environment prepared for shading: what falls in from a direction, glossy reflections of it
/// and, for images, directions in proportion to their brightness.
struct EnvironmentLight {
  Environment source;
  /// Replacement of the lower half where there is a ground.
  std::optional<Vec3f> ground_radiance;
  /// Radiance blurred by the gloss's lobe: `glossy[level]` for roughness level / (levels - 1);
  /// one column where the light does not depend on the azimuth.
  std::vector<Image> glossy;
  /// Cumulative brightness of the image over cells of equal azimuth and height, row by row.
  std::vector<float> cumulative;
  int cell_columns = 0;
  int cell_rows = 0;
};

/// O(glossy table), about 20 ms.
EnvironmentLight environment_light(const Environment& environment,
                                   const std::optional<Vec3f>& ground_radiance);

/// Radiance from a unit direction, of the environment alone.
Vec3f source_radiance(const Environment& environment, Vec3f direction);

/// Radiance from a unit direction; from below, the ground's.
Vec3f radiance(const EnvironmentLight& light, Vec3f direction);

/// Radiance averaged over the gloss's lobe about a reflected direction (Karis, "Real shading in
/// Unreal Engine 4", 2013: prefiltered with normal = view = reflection).
Vec3f glossy_radiance(const EnvironmentLight& light, Vec3f direction, float roughness);

/// Irradiance of a surface that nothing blocks, by quadrature.
Vec3f open_irradiance(const EnvironmentLight& light, Vec3f normal);

/// Direction `index` of those that `seed` names and the factor that turns its radiance into a share
/// of irradiance: irradiance = mean of radiance x weight. Cosine for gradients; for images, half of
/// the points by brightness, combined by the balance heuristic (Veach 1995). Weight 0: below the
/// surface.
struct EnvironmentSample {
  Vec3f direction;
  float weight;
};
EnvironmentSample sample_environment(const EnvironmentLight& light, const Frame& frame,
                                     std::uint32_t index, std::uint32_t seed);

}  // namespace atelier
