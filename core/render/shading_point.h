#pragma once

#include "core/render/prepared_scene.h"

namespace atelier {

/// Data for the shading of one hit: position, directions and material.
struct ShadingPoint {
  Vec3f position;  ///< where light is received from; on the smooth surface, off the facet
  Vec3f facet;     ///< unit normal of the triangle, to the viewer's side
  Vec3f normal;    ///< unit shading normal, to the viewer's side
  Vec3f view;      ///< unit, to the viewer
  Vec3f base;      ///< reflectance before it is split into diffuse and metallic
  Vec3f diffuse;   ///< of the base layer, not yet dimmed by gloss and sheen
  Vec3f f0;        ///< of the gloss at normal incidence
  Vec3f ambient;   ///< irradiance of the environment, where gathered per vertex
  float roughness;
  float sheen;
  float gloss;  ///< 0: no gloss at all
  float n_dot_v;
  Vec3f rebound;        ///< factor on the gloss for light that bounces between its microfacets
  float base_share;     ///< of light that sheen leaves to the layers under it
  Vec3f diffuse_share;  ///< of that light, what the gloss leaves to the diffuse base
};

/// One hit of a ray on a mesh: barycentrics of the second and third corner, as Embree gives them.
struct MeshHit {
  std::uint32_t mesh, face;
  float u, v;
  float distance;  ///< along the ray, metres
};

/// `pixel_angle` is the width of a pixel at distance 1; `samples` of one pixel share its texture
/// footprint.
ShadingPoint shading_point(const PreparedScene::Data& scene, const MeshHit& hit, Vec3f origin,
                           Vec3f direction, float pixel_angle, int samples);

/// The ground at a point, diffuse.
ShadingPoint ground_point(const PreparedScene::Data& scene, Vec3f position, Vec3f direction);

/// Diffuse light out for irradiance in.
Vec3f diffuse_light(const ShadingPoint& point, Vec3f irradiance);

/// Gloss and sheen towards the viewer per radiance from `light_direction`, times its cosine.
Vec3f gloss_towards_viewer(const ShadingPoint& point, Vec3f light_direction, float n_dot_l);

/// All light of the environment towards the viewer: diffuse, sheen and gloss; `openness` in [0,1]
/// dims the gloss.
Vec3f ambient_light(const PreparedScene::Data& scene, const ShadingPoint& point, Vec3f irradiance,
                    float openness);

}  // namespace atelier
