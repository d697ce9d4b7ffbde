#include "pipeline/pictures/normal_pictures.h"

#include "core/io/srgb.h"
#include "core/render/surface_maps.h"

namespace atelier {
namespace {

/// The surfaces of a frame, without what they look like.
PreparedScene surfaces_of(const PaintedScene& scene, std::size_t frame) {
  Scene surfaces;
  for (std::size_t layer = 0; layer < scene.layers.size(); ++layer) {
    const Points& vertices = scene.vertices[frame][layer];
    if (vertices.rows() > 0) {
      RenderMesh mesh;
      mesh.mesh.vertices = vertices;
      mesh.mesh.faces = scene.layers[layer].faces;
      surfaces.meshes.push_back(std::move(mesh));
    }
  }
  PrepareOptions none;
  none.ambient = Ambient::None;
  return prepare(surfaces, none);
}

/// The camera with `samples` pixels a side for each of its own.
Camera finer(Camera camera, int samples) {
  camera.width *= samples;
  camera.height *= samples;
  camera.fx *= samples;
  camera.fy *= samples;
  camera.cx *= samples;
  camera.cy *= samples;
  return camera;
}

/// Linear colour of a normal in the camera's frame.
Eigen::Vector3f color_of(Eigen::Vector3d normal) {
  normal = normal.z() > 0 ? Eigen::Vector3d(-normal) : normal;  // of the side that is seen
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) {
    const double shown = (1 + (c == 0 ? normal[c] : -normal[c])) / 2;
    color[c] = linear_from_srgb(static_cast<float>(shown));
  }
  return color;
}

Image normal_picture(const PreparedScene& surfaces, const Camera& camera,
                     const PaintOptions& options) {
  const int samples = options.samples;
  const SurfaceMaps maps = surface_maps(surfaces, finer(camera, samples));
  Image picture(camera.width, camera.height, 4);
  const float share = 1.0F / static_cast<float>(samples * samples);
  for (int y = 0; y < maps.mesh.height; ++y) {
    for (int x = 0; x < maps.mesh.width; ++x) {
      float* const pixel = &picture.at(x / samples, y / samples, 0);
      if (maps.mesh.at(x, y, 0) < 0) {
        for (int c = 0; c < 3 && !options.alpha; ++c) {
          pixel[c] += share * static_cast<float>(options.background[static_cast<std::size_t>(c)]);
        }
        pixel[3] += options.alpha ? 0 : share;
        continue;
      }
      const float* const n = &maps.normal.at(x, y, 0);
      const Eigen::Vector3f color =
          color_of(camera.camera_from_world_rotation * Eigen::Vector3d(n[0], n[1], n[2]));
      for (int c = 0; c < 3; ++c) {
        pixel[c] += share * color[c];
      }
      pixel[3] += share;
    }
  }
  return picture;
}

}  // namespace

bool draw_normals(const PaintedScene& scene, const PaintOptions& options, const PaintHooks& hooks) {
  const PaintedScene drawn = without_penetration(scene);
  for (std::size_t frame = 0; frame < drawn.frame_ids.size(); ++frame) {
    if (hooks.stop && hooks.stop()) {
      return false;
    }
    const Camera& camera = drawn.cameras.at(drawn.cameras.size() == 1 ? 0 : frame);
    const Image picture = normal_picture(surfaces_of(drawn, frame), camera, options);
    if (hooks.picture) {
      hooks.picture(static_cast<Index>(frame), picture);
    }
  }
  return true;
}

}  // namespace atelier
