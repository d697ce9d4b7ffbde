// Learns from one image how a square of printed cloth looks and draws it from another camera.
//   draw_with_network OUT.png [ITERATIONS]
#include <Eigen/Geometry>
#include <cstdlib>
#include <iostream>
#include <memory>

#include "appearance/network/painter.h"
#include "appearance/network/train.h"
#include "appearance/prepare.h"
#include "core/io/image_file.h"

using namespace atelier;

/// A camera of 128 x 128 pixels at (x, 2, 0) m that looks at the origin; Z points down in its
/// image.
static Camera looking_down(const std::string& id, double x) {
  Camera camera;
  camera.id = id;
  camera.width = camera.height = 128;
  camera.fx = camera.fy = 160;
  camera.cx = camera.cy = 64;
  const Eigen::Vector3d eye(x, 2, 0);
  const Eigen::Vector3d forward = -eye.normalized();
  const Eigen::Vector3d down = Eigen::Vector3d::UnitZ();
  camera.camera_from_world_rotation << down.cross(forward).transpose(), down.transpose(),
      forward.transpose();
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * eye;
  return camera;
}

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: draw_with_network OUT.png [ITERATIONS]\n";
    return 2;
  }
  Points vertices(4, 3);  // a square of 1 m, seen from above
  vertices << -0.5, 0, -0.5, 0.5, 0, -0.5, -0.5, 0, 0.5, 0.5, 0, 0.5;
  DrawnSurface surface;
  surface.atlas.uvs.resize(4, 2);
  surface.atlas.uvs << 0.05, 0.95, 0.95, 0.95, 0.05, 0.05, 0.95, 0.05;
  surface.atlas.uv_faces.resize(2, 3);
  surface.atlas.uv_faces << 0, 2, 1, 1, 2, 3;
  surface.atlas.chart = {0, 0};
  const DressedSubject subject = {
      {"cloth"}, {surface.atlas.uv_faces}, [&](int) { return std::vector{vertices}; }};

  ByteImage taken(128, 128, 3, 60);  // squares of 8 x 8 pixels, sRGB
  for (int i = 0; i < 128 * 128; ++i) {
    taken.at(i % 128, i / 128, (i % 128 / 8 + i / 128 / 8) % 2) = 220;
  }
  const std::vector<Camera> cameras = {looking_down("above", 0)};
  const std::vector<int> frame_ids = {0};
  const AppearanceData data =
      prepare_appearance(subject, surface, {cameras, frame_ids, [&](std::size_t, int) {
                                              return TakenPicture{taken, {}};
                                            }});

  TrainOptions options;
  options.resolution = 64;
  options.channels = 2;
  options.iterations = count > 2 ? std::atoi(arguments[2]) : 50;
  options = resolved(options);
  const TrainResult result = train(start_training(data, options), data, options, Device::Cpu);

  const auto model = std::make_shared<const AppearanceModel>(result.training.model);
  Painter painter({{surface.atlas.uv_faces, model}}, {}, Device::Cpu);
  write_image(arguments[1], painter.paint({vertices}, looking_down("aside", 1)));
  std::cout << "learnt from " << data.views[0].pixel.size() << " pixels, drawn in " << arguments[1]
            << "\n";
}
