#include "core/render/scene.h"

#include <cmath>

#include "core/error.h"
#include "core/quantity_text.h"

namespace atelier {

namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& found,
                         const std::string& expected) {
  throw DataError("scene", where, found, expected);
}

void check_color(const Eigen::Vector3f& color, float max, const std::string& where) {
  for (int c = 0; c < 3; ++c) {
    if (!(color[c] >= 0 && color[c] <= max)) {
      refuse(where, short_number(color[c], 7),
             max > 1 ? "a finite number that is not negative" : "a number in [0,1]");
    }
  }
}

void check_radiance(const Eigen::Vector3f& color, const std::string& where) {
  check_color(color, std::numeric_limits<float>::max(), where);
}

void check_range(float value, float min, float max, const std::string& where) {
  if (!(value >= min && value <= max)) {
    refuse(where, std::to_string(value),
           "a number in [" + std::to_string(min) + ", " + std::to_string(max) + "]");
  }
}

void check_image(const Image& image, const std::string& where) {
  if (image.width <= 0 || image.height <= 0 || image.channels != 3 ||
      image.data.size() !=
          static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3) {
    refuse(where,
           std::to_string(image.width) + "x" + std::to_string(image.height) + " with " +
               std::to_string(image.channels) + " channels and " +
               std::to_string(image.data.size()) + " numbers",
           "a linear RGB image of 3 channels, width x height x 3 numbers");
  }
  for (const float value : image.data) {
    if (!(value >= 0 && std::isfinite(value))) {
      refuse(where, std::to_string(value), "finite numbers that are not negative");
    }
  }
}

void check_look(const Look& look, const Mesh& mesh, const std::string& where) {
  check_color(look.color, 1, where + " color");
  check_range(look.roughness, 0.05f, 1, where + " roughness");
  check_range(look.specular, 0, 1, where + " specular");
  check_range(look.metallic, 0, 1, where + " metallic");
  check_range(look.sheen, 0, 1, where + " sheen");
  check_range(look.edge_width, 0, 100, where + " edge_width");
  if (look.back_color) {
    check_color(*look.back_color, 1, where + " back_color");
  }
  if (look.edge_color) {
    check_color(*look.edge_color, 1, where + " edge_color");
  }
  if (look.texture) {
    check_image(*look.texture, where + " texture");
    if (mesh.uv_faces.rows() == 0 && mesh.faces.rows() != 0) {
      refuse(where + " texture", "a mesh without uvs", "uvs and uv_faces, or no texture");
    }
  }
}

void check_light(const AreaLight& light, const std::string& where) {
  check_radiance(light.radiance, where + " radiance");
  if (!light.center.allFinite() || !light.half_u.allFinite() || !light.half_v.allFinite()) {
    refuse(where, "a position that is not finite", "metres");
  }
  const double u = light.half_u.norm();
  const double v = light.half_v.norm();
  if (!(u * v > 1e-12)) {
    refuse(where, "a rectangle without area", "half_u and half_v that span one");
  }
  if (std::abs(light.half_u.dot(light.half_v)) > 1e-4 * u * v) {
    refuse(where, "half_u and half_v that are not orthogonal", "a rectangle");
  }
}

}  // namespace

Environment constant_environment(const Eigen::Vector3f& radiance) {
  Environment environment;
  environment.zenith = environment.horizon = environment.nadir = radiance;
  return environment;
}

void check_scene(const Scene& scene) {
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const std::string where = "mesh " + std::to_string(i);
    check_mesh(scene.meshes[i].mesh, "scene, " + where);
    check_look(scene.meshes[i].look, scene.meshes[i].mesh, where);
  }
  for (std::size_t i = 0; i < scene.area_lights.size(); ++i) {
    check_light(scene.area_lights[i], "area light " + std::to_string(i));
  }
  check_radiance(scene.environment.zenith, "environment zenith");
  check_radiance(scene.environment.horizon, "environment horizon");
  check_radiance(scene.environment.nadir, "environment nadir");
  check_range(scene.environment.image_scale, 0, 1e6f, "environment image_scale");
  if (scene.environment.image) {
    check_image(*scene.environment.image, "environment image");
  }
  check_radiance(scene.background.top, "background top");
  check_radiance(scene.background.bottom, "background bottom");
  if (scene.ground) {
    check_color(scene.ground->color, 1, "ground color");
    if (!std::isfinite(scene.ground->height)) {
      refuse("ground height", std::to_string(scene.ground->height), "metres");
    }
  }
}

}  // namespace atelier
