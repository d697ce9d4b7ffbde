#include "core/io/mesh_file.h"

#include <cstdio>
#include <string>

#include "core/error.h"
#include "core/io/alembic.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_gltf.h"
#include "core/io/mesh_obj.h"
#include "core/io/mesh_ply.h"
#include "core/io/mesh_stl.h"
#include "core/io/scene_file.h"
#include "core/io/usd_mesh.h"
#include "core/printable.h"

namespace atelier {
namespace {

/// glTF means metres and Y; the FBX reader turns what the file says into them.
constexpr MeshConvention kSceneConvention{.metres_per_unit = 1, .up = 'y'};

constexpr const char* kMeshExtensions =
    ".obj, .ply, .stl, .glb, .gltf, .fbx, .usdc, .usda or .usdz";

/// Properties of polygons that a Mesh does not hold.
void add_losses(const PolygonMesh& polygons, const std::string& name, MeshFile& file) {
  const auto add = [&](const char* code, const std::string& what) {
    file.findings.push_back({Severity::Note, code, name, what, ""});
  };
  if (polygons.uvs.rows() > 0 && file.mesh.uvs.rows() == 0) {
    add("mesh-uvs-dropped",
        "texture coordinates are not kept: not every corner of a face has them");
  }
  if (polygons.normals.rows() > 0 && file.mesh.normals.rows() == 0) {
    add("mesh-normals-dropped",
        "normals are not kept: corners in one vertex differ, or some have none");
  }
  std::string names;
  const auto named = [&](const std::vector<std::string>& all, const char* noun) {
    if (!all.empty()) {
      names += (names.empty() ? "" : ", ") + counted(static_cast<std::int64_t>(all.size()), noun);
    }
  };
  named(polygons.group_names, "group");
  named(polygons.object_names, "object");
  named(polygons.material_names, "material");
  if (!names.empty()) {
    add("mesh-names-dropped", "names are not kept: " + names);
  }
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& path, const MeshConvention& otherwise,
               const Limits& limits) {
  return read_mesh_file(path, otherwise, limits).mesh;
}

MeshFile mesh_of_scene(const GltfScene& scene, const std::string& name, const Limits& limits) {
  MeshFile file{rest_mesh(scene, name, limits), kSceneConvention, scene.findings};
  const std::vector<Finding> torn = torn_mesh_findings(scene, name);
  file.findings.insert(file.findings.end(), torn.begin(), torn.end());
  return file;
}

MeshFile read_mesh_file(const std::filesystem::path& path, const MeshConvention& otherwise,
                        const Limits& limits) {
  if (std::error_code error; std::filesystem::is_directory(path, error)) {
    throw DataError(path.string(), "", "a folder", std::string("a mesh file: ") + kMeshExtensions);
  }
  const std::string extension = lower_extension(path);
  if (extension == ".obj" || extension == ".ply" || extension == ".stl") {
    const PolygonMesh polygons = extension == ".obj"   ? read_obj(path, limits)
                                 : extension == ".ply" ? read_ply(path, limits)
                                                       : read_stl(path, limits);
    MeshFile file;
    file.mesh = in_metres_y_up(triangulated(polygons), polygons.convention, otherwise);
    file.said = polygons.convention;
    file.findings = polygons.findings;
    add_losses(polygons, path.string(), file);
    return file;
  }
  if (has_scene_extension(path)) {
    const GltfScene scene = read_scene(path, limits);
    return mesh_of_scene(scene, path.string(), limits);
  }
  if (has_usd_extension(path)) {
    UsdMesh usd = read_usd_mesh(path, limits);
    return {std::move(usd.mesh), kSceneConvention, std::move(usd.findings)};
  }
  refuse_alembic(path);
  if (std::error_code error; !std::filesystem::exists(path, error) && !error) {
    throw DataError(path.string(), "", "nothing there",
                    std::string("a mesh file: ") + kMeshExtensions);
  }
  throw DataError(
      path.string(), "",
      extension.empty() ? "a name without an extension" : "extension '" + extension + "'",
      kMeshExtensions);
}

std::optional<Finding> unit_finding(const MeshFile& file, const std::string& name) {
  constexpr double kPlausible = 20;  // m; a train is longer than a person, and shorter than this
  if (file.said.metres_per_unit > 0 || file.mesh.vertices.rows() == 0) {
    return std::nullopt;
  }
  const double extent =
      (file.mesh.vertices.colwise().maxCoeff() - file.mesh.vertices.colwise().minCoeff())
          .maxCoeff();
  if (!(extent > kPlausible)) {
    return std::nullopt;
  }
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", extent);
  return Finding{Severity::Warning, "unit-unknown", name,
                 "the file does not say its unit, and as it is taken the mesh is " +
                     std::string(text) + " m large",
                 "--input.unit says it: cm, mm"};
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
