#include "core/io/mesh_file.h"

#include <string>

#include "core/error.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_gltf.h"
#include "core/io/mesh_obj.h"
#include "core/io/mesh_ply.h"
#include "core/io/scene_file.h"

namespace atelier {
Mesh read_mesh(const std::filesystem::path& path, const MeshConvention& otherwise,
               const Limits& limits) {
  if (std::error_code error; std::filesystem::is_directory(path, error)) {
    throw DataError(path.string(), "", "a folder", "a mesh file: .obj, .ply, .glb, .gltf or .fbx");
  }
  const std::string extension = lower_extension(path);
  if (extension == ".obj" || extension == ".ply") {
    const PolygonMesh polygons =
        extension == ".obj" ? read_obj(path, limits) : read_ply(path, limits);
    return in_metres_y_up(triangulated(polygons), polygons.convention, otherwise);
  }
  if (has_scene_extension(path)) {
    return rest_mesh(read_scene(path, limits), path.string(), limits);
  }
  throw DataError(path.string(), "", "extension '" + extension + "'",
                  ".obj, .ply, .glb, .gltf or .fbx");
}

void write_mesh(const std::filesystem::path& path, const Mesh& mesh) {
  const std::string extension = lower_extension(path);
  if (extension == ".obj") {
    write_obj(path, mesh);
  } else if (extension == ".ply") {
    write_ply(path, mesh);
  } else if (extension == ".glb" || extension == ".gltf") {
    write_gltf(path, gltf_scene(mesh));
  } else {
    ATELIER_CHECK(false, "no writer for extension '" + extension + "' of " + path.string());
  }
}

}  // namespace atelier
