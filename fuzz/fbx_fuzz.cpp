#include "bodymodel/formats/gltf_body.h"
#include "core/io/mesh_fbx.h"
#include "fuzz/reader.h"

// The reader starts a process per file, so that crashes of libassimp end there and are refusals;
// what is tried here is that process, its limits, and what is made of its answer.
ATELIER_FUZZ_READER(fbx) {
  atelier::Limits limits;
  limits.worker_cpu_seconds = 2;
  limits.worker_memory_bytes = 256 << 20;
  const atelier::GltfScene scene = atelier::read_fbx(bytes, "fbx", limits);
  atelier::check_gltf(scene);
  const atelier::GltfBody body = atelier::read_gltf_body(scene, "fbx");
  atelier::check_body_model(body.model, "fbx");
  if (!scene.animations.empty()) {
    atelier::check_motion_clip(atelier::read_gltf_motion(scene, "fbx"), "fbx");
  }
}
