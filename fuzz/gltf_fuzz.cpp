#include "core/io/mesh_gltf.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(gltf) {
  const atelier::GltfScene scene = atelier::read_gltf(bytes, "gltf");
  atelier::check_gltf(scene);
  // What is read can be written and read again to the same scene.
  const std::string file = atelier::glb_bytes(scene);
  const atelier::GltfScene again = atelier::read_gltf(std::as_bytes(std::span(file)), "gltf");
  ATELIER_CHECK(again.nodes.size() == scene.nodes.size() &&
                    again.skins.size() == scene.skins.size() &&
                    again.animations.size() == scene.animations.size(),
                "glTF does not round-trip");
  atelier::check_mesh(atelier::rest_mesh(scene, "gltf"), "gltf");
}
