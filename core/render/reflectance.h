#pragma once

#include "core/render/sampling.h"
#include "core/render/vector_math.h"

namespace atelier {

/// GGX normal distribution times height-correlated Smith masking-shadowing over 4 NoV NoL, that is
/// the gloss without its Fresnel factor (Walter 2007, Heitz 2014). `roughness` is perceptual: alpha
/// = roughness^2. Cosines are positive.
float ggx(float n_dot_v, float n_dot_l, float n_dot_h, float roughness);

/// Half vector about +Z with density D cos, D the distribution of `ggx`.
Vec3f gloss_half_vector(Point2f u, float roughness);

/// Density, over solid angle, of the directions that reflect at such half vectors.
float gloss_density(float n_dot_h, float v_dot_h, float roughness);

/// Schlick's Fresnel factor 1 - (1 - F0) ... as the weight w of F = F0 (1 - w) + w.
float fresnel_weight(float v_dot_h);

/// Directional albedo of the gloss for F0: F0 * scale + bias; tabulated once by quadrature.
struct GlossAlbedo {
  float scale, bias;
};
GlossAlbedo gloss_albedo(float n_dot_v, float roughness);

/// Sheen of fabrics: Estevez and Kulla's distribution ("Production friendly microfacet sheen BRDF",
/// 2017) with Ashikhmin's visibility (Neubelt and Pettineo 2013), roughness 0.5 (our choice).
float sheen(float n_dot_v, float n_dot_l, float n_dot_h);

/// Directional albedo of the sheen; tabulated once by quadrature.
float sheen_albedo(float n_dot_v);

/// Fills the tables now rather than at first use, so that no thread waits.
void prepare_reflectance_tables();

}  // namespace atelier
