#include "core/io/scene_file.h"

#include <string>

#include "core/io/lower_extension.h"
#include "core/io/mesh_fbx.h"

namespace atelier {

bool has_scene_extension(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".glb" || extension == ".gltf" || extension == ".fbx";
}

GltfScene read_scene(const std::filesystem::path& path, const Limits& limits) {
  return lower_extension(path) == ".fbx" ? read_fbx(path, limits) : read_gltf(path, limits);
}

}  // namespace atelier
