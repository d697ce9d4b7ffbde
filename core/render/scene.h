#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/light.h"
#include "core/mesh.h"

namespace atelier {

/// How a surface looks: a diffuse base under a dielectric or metallic gloss (GGX) and, for cloth, a
/// sheen. (`Material` is the fabric's mechanics; this is what the eye sees.) Every surface is seen
/// from both sides.
struct Look {
  Eigen::Vector3f color{0.6f, 0.6f, 0.6f};  ///< diffuse reflectance, linear RGB in [0,1]
  /// Linear RGB image multiplied with `color`, bilinear in a mip pyramid, repeated outside the unit
  /// square; needs uvs.
  std::shared_ptr<const Image> texture;
  bool vertex_colors = true;  ///< multiply with the mesh's colours where it has them
  float roughness = 0.6f;     ///< of the gloss, in [0.05, 1]; 0.05 mirror-like, 1 matt
  float specular = 0.5f;  ///< strength of the gloss in [0,1]; 0.5 is plastic or skin (4% at normal)
  float metallic = 0.0f;  ///< in [0,1]; 1: no diffuse base, gloss has the base's colour
  float sheen = 0.0f;     ///< soft rim of fabrics, in [0,1]; 0.3 cotton, 1 velvet
  bool smooth = true;     ///< interpolate normals; false: facets
  std::optional<Eigen::Vector3f> back_color;  ///< diffuse reflectance of the inner side (lining)
  std::optional<Eigen::Vector3f> edge_color;  ///< draws the triangles' edges in this colour
  float edge_width = 1.0f;                    ///< of those lines, pixels
};

/// One mesh of a scene and its look.
struct RenderMesh {
  Mesh mesh;
  Look look;
};

/// The background, where nothing is hit.
struct Background {
  enum class Kind {
    Gradient,     ///< `top` to `bottom` of the image
    Environment,  ///< the environment itself
  };
  Kind kind = Kind::Gradient;
  Eigen::Vector3f top{0, 0, 0};     ///< linear RGB
  Eigen::Vector3f bottom{0, 0, 0};  ///< linear RGB
};

/// An infinite floor. It takes shadows and ambient occlusion, and throws light back up.
struct Ground {
  double height = 0;                        ///< y, metres
  Eigen::Vector3f color{0.5f, 0.5f, 0.5f};  ///< diffuse reflectance
  /// True: the floor is the background, darkened where shadows fall (a studio's seamless paper).
  /// False: a diffuse plane with a horizon.
  bool seamless = true;
};

/// Everything that an image is made of. Metres, Y up. Plain data; an empty scene is an image of
/// the background.
struct Scene {
  std::vector<RenderMesh> meshes;
  std::vector<AreaLight> area_lights;
  Environment environment;
  Background background;
  std::optional<Ground> ground;
};

/// Constant radiance from everywhere.
Environment constant_environment(const Eigen::Vector3f& radiance);

/// Throws DataError (naming the mesh by its place in the list) for meshes that check_mesh refuses,
/// textures without uvs or with other than 3 channels, numbers that are not finite, negative
/// radiance, reflectance or roughness outside their ranges, lights without area.
void check_scene(const Scene& scene);

}  // namespace atelier
