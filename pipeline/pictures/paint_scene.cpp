#include "pipeline/pictures/paint_scene.h"

#include <algorithm>
#include <cstdio>

#include "appearance/painted_picture.h"
#include "appearance/remove_penetration.h"
#include "core/archive.h"
#include "core/io/child_program.h"
#include "core/io/temporary_folder.h"

namespace atelier {

Points tucked_skin(const Points& skin, const Triangles& faces, const JoinedSurfaces& cloth,
                   const std::vector<char>& over) {
  constexpr double kReach = 0.03;  // m
  Points tucked = remove_penetration(skin, faces, cloth.vertices, cloth.faces, kReach);
  for (std::size_t v = 0; v < over.size(); ++v) {
    if (over[v] != 0) {
      tucked.row(static_cast<Index>(v)) = skin.row(static_cast<Index>(v));
    }
  }
  return tucked;
}

PaintedScene without_penetration(PaintedScene scene) {
  const auto is_body = [](const SceneLayer& layer) { return layer.name == "body"; };
  const auto body = std::find_if(scene.layers.begin(), scene.layers.end(), is_body);
  if (body == scene.layers.end()) {
    return scene;
  }
  const auto b = static_cast<std::size_t>(body - scene.layers.begin());
  for (std::vector<Points>& vertices : scene.vertices) {
    std::vector<Surface> worn;
    for (std::size_t i = 0; i < scene.layers.size(); ++i) {
      if (i != b && vertices[i].rows() > 0) {
        worn.push_back({&vertices[i], &scene.layers[i].faces});
      }
    }
    if (vertices[b].rows() > 0) {
      const JoinedSurfaces cloth = joined_surfaces(worn);
      vertices[b] = tucked_skin(vertices[b], scene.layers[b].faces, cloth, scene.layers[b].over);
    }
  }
  return scene;
}

bool paint_scene(const PaintedScene& scene, const PaintOptions& options, Device device,
                 const PaintHooks& hooks) {
  const TemporaryFolder between;
  const std::filesystem::path file = between.path / "scene.h5";
  write_archive(file, archive_of(without_penetration(scene)));
  std::vector<std::string> words = {"paint",    file.string(),       between.path.string(),
                                    "--device", device_name(device), "--ahead",
                                    "4"};
  PaintOptions known = options;
  for (const OptionField& field : describe(known).fields) {
    words.push_back("--" + field.name);
    words.push_back(option_text(field));
  }
  Index next = 0;
  return run_child_program(
      "atelier-appearance", words, "a build with libtorch (libtorch-dev)",
      [&](const std::string& line) {
        int frame_id = 0;
        if (std::sscanf(line.c_str(), "frame %d", &frame_id) != 1) {
          return;
        }
        char name[32];
        std::snprintf(name, sizeof(name), "%06d.h5", frame_id);
        const auto at = scene.cameras.size() == 1 ? 0 : static_cast<std::size_t>(next);
        const Camera& camera = scene.cameras.at(at);
        const Image picture =
            painted_picture_of(read_archive(between.path / name, "atelier.painted_picture", 1),
                               camera.width, camera.height, name);
        std::filesystem::remove(between.path / name);
        if (hooks.picture) {
          hooks.picture(next, picture);
        }
        ++next;
      },
      [&] { return hooks.stop && hooks.stop(); });
}

}  // namespace atelier
