#include "appearance/painted_scene.h"
#include "fuzz/forged_archive.h"
#include "fuzz/reader.h"

/// What is read has every layer in every frame, can be written and reads the same.
ATELIER_FUZZ_READER(painted_scene) {
  const atelier::PaintedScene scene =
      atelier::painted_scene_of(atelier::parse_archive(atelier::fuzz::with_right_digest(bytes),
                                                       "atelier.painted_scene", 1, "scene"),
                                "scene");
  for (const auto& frame : scene.vertices) {
    ATELIER_CHECK(frame.size() == scene.layers.size(), "a frame has every layer");
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const atelier::Triangles& faces = scene.layers[i].faces;
      ATELIER_CHECK(frame[i].allFinite() && (frame[i].rows() == 0 || faces.rows() == 0 ||
                                             faces.maxCoeff() < frame[i].rows()),
                    "what is worn has the vertices that its faces name");
    }
  }
  const atelier::PaintedScene again =
      atelier::painted_scene_of(atelier::archive_of(scene), "written");
  ATELIER_CHECK(again.frame_ids == scene.frame_ids && again.layers.size() == scene.layers.size() &&
                    again.cameras.size() == scene.cameras.size(),
                "a scene reads back as it was");
  for (std::size_t f = 0; f < scene.vertices.size(); ++f) {
    for (std::size_t i = 0; i < scene.layers.size(); ++i) {
      ATELIER_CHECK(atelier::equal_arrays(again.vertices[f][i], scene.vertices[f][i]),
                    "vertices read back as they were");
    }
  }
}
