#include "bodymodel/formats/gltf_body.h"
#include "fuzz/reader.h"

// The skinned body of a scene and an animation of it as a motion, which scenes without skins have
// too.
ATELIER_FUZZ_READER(gltf_body) {
  const atelier::GltfScene scene = atelier::read_gltf(bytes, "gltf");
  if (!scene.skins.empty() || scene.animations.empty()) {
    const atelier::GltfBody body = atelier::read_gltf_body(scene, "gltf");
    atelier::check_body_model(body.model, "gltf");
  }
  if (!scene.animations.empty()) {
    atelier::check_motion_clip(atelier::read_gltf_motion(scene, "gltf"), "gltf");
  }
}
