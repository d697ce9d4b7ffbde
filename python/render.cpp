#include "core/render/render.h"

#include <optional>

#include "core/render/framing.h"
#include "core/render/scene.h"
#include "core/render/studio.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/images.h"
#include "python/options.h"
#include "python/signals.h"

ATELIER_OPTIONS(RenderOptions);
ATELIER_OPTIONS(PrepareOptions);
ATELIER_OPTIONS(PictureOptions);
ATELIER_OPTIONS(FramingOptions);

namespace atelier::python {
namespace {

using namespace py::literals;

void bind_looks(py::module_& module) {
  py::class_<Look> look(module, "Look",
                        "How a surface looks: a diffuse base under a gloss, a sheen.");
  look.def(py::init([](const Eigen::Vector3f& color, const py::object& texture, float roughness,
                       float specular, float sheen, bool smooth) {
             Look made;
             made.color = color;
             if (!texture.is_none()) {
               made.texture = std::make_shared<const Image>(image_of<float>(texture));
             }
             made.roughness = roughness;
             made.specular = specular;
             made.sheen = sheen;
             made.smooth = smooth;
             return made;
           }),
           "color"_a = std::vector<float>{0.6F, 0.6F, 0.6F}, "texture"_a = py::none(),
           "roughness"_a = 0.6, "specular"_a = 0.5, "sheen"_a = 0.0, "smooth"_a = true,
           "`texture`: linear RGB [H,W,3]; needs uvs.");
  array_field<&Look::color>(look, "color", "[3] diffuse reflectance, linear RGB in [0,1]");
  look.def_readwrite("vertex_colors", &Look::vertex_colors, "multiply with the mesh's colours");
  look.def_readwrite("roughness", &Look::roughness, "[0.05, 1]");
  look.def_readwrite("specular", &Look::specular, "[0, 1]");
  look.def_readwrite("metallic", &Look::metallic, "[0, 1]");
  look.def_readwrite("sheen", &Look::sheen, "[0, 1]");
  look.def_readwrite("smooth", &Look::smooth, "interpolate normals");
  look.def_readwrite("back_color", &Look::back_color, "[3] of the inner side, or None");
  look.def_readwrite("edge_color", &Look::edge_color, "[3] of drawn edges, or None");
  look.def_readwrite("edge_width", &Look::edge_width, "pixels");
  py::class_<RenderMesh> mesh(module, "RenderMesh", "One mesh of a scene and its look.");
  mesh.def(py::init([](Mesh shape, Look seen) {
             return RenderMesh{std::move(shape), std::move(seen)};
           }),
           "mesh"_a, "look"_a = Look{});
  struct_field<&RenderMesh::mesh>(mesh, "mesh");
  struct_field<&RenderMesh::look>(mesh, "look");
}

void bind_scene(py::module_& module) {
  py::class_<AreaLight> light(module, "AreaLight", "A rectangle that shines to half_u x half_v.");
  light.def(py::init([](const Eigen::Vector3d& center, const Eigen::Vector3d& half_u,
                        const Eigen::Vector3d& half_v, const Eigen::Vector3f& radiance) {
              return AreaLight{center, half_u, half_v, radiance};
            }),
            "center"_a, "half_u"_a, "half_v"_a, "radiance"_a);
  array_field<&AreaLight::center>(light, "center", "[3] metres");
  array_field<&AreaLight::half_u>(light, "half_u", "[3] metres");
  array_field<&AreaLight::half_v>(light, "half_v", "[3] metres");
  array_field<&AreaLight::radiance>(light, "radiance", "[3] linear RGB");
  py::class_<Ground> ground(module, "Ground", "An infinite floor.");
  ground.def(py::init([](double height, const Eigen::Vector3f& color, bool seamless) {
               return Ground{height, color, seamless};
             }),
             "height"_a = 0.0, "color"_a = std::vector<float>{0.5F, 0.5F, 0.5F},
             "seamless"_a = true);
  ground.def_readwrite("height", &Ground::height, "y, metres");
  ground.def_readwrite("seamless", &Ground::seamless);
  py::class_<Scene> scene(module, "Scene", "Everything that an image is made of. Metres, Y up.");
  scene.def(py::init([](std::vector<RenderMesh> meshes, std::vector<AreaLight> lights,
                        const Eigen::Vector3f& environment, std::optional<Ground> floor) {
              Scene made;
              made.meshes = std::move(meshes);
              made.area_lights = std::move(lights);
              made.environment = constant_environment(environment);
              made.ground = std::move(floor);
              return made;
            }),
            "meshes"_a, "area_lights"_a = std::vector<AreaLight>{},
            "environment"_a = std::vector<float>{0, 0, 0}, "ground"_a = py::none(),
            "`environment`: radiance from everywhere, linear RGB.");
  list_field<&Scene::meshes>(scene, "meshes");
  list_field<&Scene::area_lights>(scene, "area_lights");
  scene.def_readwrite("ground", &Scene::ground);
  module.def("studio_scene", &studio_scene, "meshes"_a, "azimuth"_a = 0.0,
             "The studio's light round the meshes, seamless paper under them.");
}

void bind_cameras(py::module_& module) {
  module.def(
      "camera_around",
      [](const Points& points, double azimuth, double elevation, int width, int height,
         const FramingOptions& options) {
        return camera_around(points, {azimuth, elevation}, width, height, options);
      },
      "points"_a, "azimuth"_a = kThreeQuarter.azimuth, "elevation"_a = kThreeQuarter.elevation,
      "width"_a = 600, "height"_a = 800, "options"_a = py::none(),
      "A camera from which all points lie just inside the image; radians, 0: in front (+Z).");
  module.def(
      "turntable_cameras",
      [](const Points& points, int count, double azimuth, double elevation, int width, int height,
         const FramingOptions& options) {
        return turntable_cameras(points, {azimuth, elevation}, count, width, height, options);
      },
      "points"_a, "count"_a, "azimuth"_a = kFront.azimuth, "elevation"_a = kFront.elevation,
      "width"_a = 600, "height"_a = 800, "options"_a = py::none(),
      "`count` cameras all the way round.");
}

void bind_images(py::module_& module) {
  module.def(
      "render",
      [](const Scene& scene, const Camera& camera, const RenderOptions& options,
         const PrepareOptions& preparation) {
        Image image;
        {
          const LongCall released;
          image = render(prepare(scene, preparation), camera, options);
        }
        return image_array(std::move(image));
      },
      "scene"_a, "camera"_a, "options"_a = py::none(), "preparation"_a = py::none(),
      "Linear RGB, float32 [H,W,3] (RGBA with `options.alpha`), not clamped.");
  module.def(
      "picture_of",
      [](const std::vector<RenderMesh>& meshes, double azimuth, double elevation,
         const PictureOptions& options) {
        Image image;
        {
          const LongCall released;
          image = picture_of(meshes, View{azimuth, elevation}, options);
        }
        return image_array(std::move(image));
      },
      "meshes"_a, "azimuth"_a = kThreeQuarter.azimuth, "elevation"_a = kThreeQuarter.elevation,
      "options"_a = py::none(),
      "Meshes in the studio, tone mapped: linear RGB in [0,1], float32 [H,W,3].");
  module.def("clay_look", &clay_look, "Soft grey clay whose inner sides are warm.");
}

}  // namespace

void bind_render(py::module_& module) {
  ATELIER_OPTIONS_CLASS(RenderOptions);
  ATELIER_OPTIONS_CLASS(PrepareOptions);
  ATELIER_OPTIONS_CLASS(PictureOptions);
  ATELIER_OPTIONS_CLASS(FramingOptions);
  bind_looks(module);
  bind_scene(module);
  bind_cameras(module);
  bind_images(module);
}

}  // namespace atelier::python
