#include "pipeline/pictures/animation_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/render/tone.h"
#include "core/unknown_value.h"

namespace atelier {
namespace {

/// Azimuth of a camera's place as seen from a point, as in View.
double azimuth_of(const Camera& camera, const Eigen::Vector3d& middle) {
  const Eigen::Vector3d from = camera_center(camera) - middle;
  return std::atan2(from.x(), from.z());
}

/// A stand-in of the subject's size, for lights in proportion to all that it does.
RenderMesh stand_in(const Points& points) {
  RenderMesh mesh;
  mesh.mesh.vertices = points;
  mesh.mesh.faces.resize(1, 3);
  mesh.mesh.faces << 0, 1, 2;
  return mesh;
}

const Camera& captured_camera(const std::vector<Camera>& captured, const std::string& name) {
  std::string names;
  for (const Camera& camera : captured) {
    if (camera.id == name) {
      return camera;
    }
    names += (names.empty() ? "" : ", ") + camera.id;
  }
  std::vector<std::string> known = animation_views();
  for (const Camera& camera : captured) {
    known.push_back(camera.id);
  }
  throw UnknownValue("", "camera", name,
                     "front, side, back, three-quarter, orbit" +
                         (names.empty() ? std::string() : ", or one of the capture's: " + names) +
                         did_you_mean(name, known));
}

}  // namespace

OptionTable describe(AnimationViewOptions& options) {
  OptionTable table;
  table.add("camera", options.camera, std::vector<std::string>{},
            "Camera of the images: front, side, back, three-quarter, orbit (once round), or a "
            "camera of the capture by name, at that camera's own size");
  table.add("background", options.background, {"studio", "white", "black", "transparent"},
            "Background behind the subject; transparent: images with alpha");
  table.add("drawn_by", options.drawn_by, {"auto", "networks", "plain"},
            "Renderer of the images: networks (learnt from the capture by atelier appearance), "
            "plain (one colour for each garment), auto (networks where they know some of what is "
            "worn, else plain)");
  table.add(describe(options.picture));
  return table;
}

std::vector<std::string> animation_views() {
  return {kAnimationViews.begin(), kAnimationViews.end()};
}

void require_view(const AnimationViewOptions& options, const std::vector<Camera>& captured) {
  if (std::find(kAnimationViews.begin(), kAnimationViews.end(), options.camera) ==
      kAnimationViews.end()) {
    captured_camera(captured, options.camera);
  }
}

Points box_corners(const Points& points) {
  const Eigen::RowVector3d low = points.colwise().minCoeff();
  const Eigen::RowVector3d high = points.colwise().maxCoeff();
  Points corners(8, 3);
  for (int i = 0; i < 8; ++i) {
    for (int k = 0; k < 3; ++k) {
      corners(i, k) = (i >> k & 1) != 0 ? high[k] : low[k];
    }
  }
  return corners;
}

AnimationView animation_view(const Points& points, double facing, int frames,
                             const std::vector<Camera>& captured,
                             const AnimationViewOptions& options) {
  const PictureOptions& picture = options.picture;
  AnimationView view;
  double azimuth = facing;
  const auto fixed = [&](View from) {
    azimuth = from.azimuth += facing;
    view.cameras.assign(
        static_cast<std::size_t>(frames),
        camera_around(points, from, picture.width, picture.height, picture.framing));
  };
  if (options.camera == "front") {
    fixed(kFront);
  } else if (options.camera == "side") {
    fixed(kSide);
  } else if (options.camera == "back") {
    fixed(kBack);
  } else if (options.camera == "three-quarter") {
    fixed(kThreeQuarter);
  } else if (options.camera == "orbit") {
    view.cameras = turntable_cameras(points, {kFront.azimuth + facing, kFront.elevation}, frames,
                                     picture.width, picture.height, picture.framing);
  } else {
    const Camera& camera = captured_camera(captured, options.camera);
    azimuth = azimuth_of(camera, points.colwise().mean().transpose());
    view.cameras.assign(static_cast<std::size_t>(frames), camera);
  }
  view.studio = studio_scene({stand_in(points)}, azimuth);
  view.studio.meshes.clear();
  if (options.background != "studio") {
    const float shade = options.background == "white" ? 1.0F : 0.0F;
    view.studio.background.top = view.studio.background.bottom = {shade, shade, shade};
    view.studio.ground.reset();
    view.alpha = options.background == "transparent";
  }
  return view;
}

Image animation_picture(const AnimationView& view, int frame, std::vector<RenderMesh> meshes,
                        const AnimationViewOptions& options) {
  Scene scene = view.studio;
  scene.meshes = std::move(meshes);
  RenderOptions how;
  how.samples = options.picture.samples;
  how.ambient_samples = 4;
  how.alpha = view.alpha;
  return tone_mapped(render(scene, view.cameras[static_cast<std::size_t>(frame)], how),
                     {.dither = 1});
}

Look skin_look() {
  Look look;
  look.color = {0.62F, 0.45F, 0.36F};
  look.roughness = 0.5F;
  look.specular = 0.3F;
  return look;
}

Look textured_skin_look(std::shared_ptr<const Image> texture) {
  Look look = skin_look();
  look.color = {1, 1, 1};
  look.texture = std::move(texture);
  return look;
}

Look cloth_look(std::size_t garment) {
  constexpr std::array<std::array<float, 3>, 4> kColors = {
      {{0.14F, 0.22F, 0.42F}, {0.60F, 0.55F, 0.44F}, {0.40F, 0.12F, 0.13F}, {0.16F, 0.34F, 0.22F}}};
  const auto& color = kColors[garment % kColors.size()];
  Look look;
  look.color = {color[0], color[1], color[2]};
  look.roughness = 0.8F;
  look.specular = 0.1F;
  look.sheen = 0.3F;
  return look;
}

}  // namespace atelier
