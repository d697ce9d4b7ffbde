#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/render/environment_light.h"
#include "core/render/ground_shadows.h"
#include "core/render/mip_pyramid.h"
#include "core/render/ray_tree.h"
#include "core/render/rectangle_light.h"
#include "core/render/render.h"

namespace atelier {

/// A mesh in the arrays that Embree and shading read.
struct PreparedMesh {
  std::vector<float> positions;        ///< [V,3], padded by one
  std::vector<std::uint32_t> indices;  ///< [F,3]
  std::vector<Vec3f> normals;          ///< [V] if smooth, else empty
  std::vector<Vec3f> colors;           ///< [V] or empty
  std::vector<Point2f> uvs;            ///< or empty
  std::vector<std::uint32_t> uv_indices;
  Look look;
  std::shared_ptr<const MipPyramid> texture;
  /// Irradiance of the environment at each vertex, of the front and of the back; empty unless
  /// gathered per vertex.
  std::vector<Vec3f> front_irradiance;
  std::vector<Vec3f> back_irradiance;

  Vec3f position(std::uint32_t vertex) const {
    return {positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]};
  }
};

/// Irradiance of the environment over a square of the ground, bilinear; outside it is open.
struct GroundIrradiance {
  float min_x = 0, min_z = 0;
  float cell = 0;  ///< metres
  Image values;    ///< empty: not gathered
};

struct PreparedTextures::Data {
  struct Texture {
    std::shared_ptr<const Image> source;  ///< kept, so that no other image gets its address
    std::shared_ptr<const MipPyramid> pyramid;
  };
  std::map<const Image*, Texture> textures;
};

struct PreparedScene::Data {
  std::vector<PreparedMesh> meshes;
  std::vector<RectangleLight> lights;
  EnvironmentLight environment;
  Background background;
  std::optional<Ground> ground;
  GroundIrradiance ground_irradiance;
  GroundShadows ground_shadows;
  Vec3f open_ground_irradiance{0, 0, 0};  ///< of the environment, nothing in the way
  Ambient ambient = Ambient::PerPixel;
  float epsilon = 0;  ///< metres: how far rays start off the surface that they leave
  RayTree tree;
};

/// Mean of the environment's radiance times visibility about a normal, times pi: irradiance. Rays
/// `first` to `first + count` of those that `seed` names; `rays` is scratch.
Vec3f gathered_irradiance(const PreparedScene::Data& scene, Vec3f point, Vec3f normal, int count,
                          std::uint32_t seed, OcclusionRays& rays);

}  // namespace atelier
