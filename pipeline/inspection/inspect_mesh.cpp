#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/io/scene_file.h"
#include "core/io/usd_mesh.h"
#include "core/mesh_statistics.h"
#include "core/printable.h"
#include "core/topology.h"
#include "pipeline/inspection/inspection.h"

namespace atelier {
namespace {

std::vector<double> numbers(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

/// @param parted  of a format that parts vertices where texture coordinates or normals do
void add_mesh(const MeshFile& file, const std::string& place, bool parted, Inspection& inspection) {
  const Mesh& mesh = file.mesh;
  const MeshStatistics s = mesh_statistics(mesh);
  inspection.add("kind", "mesh");
  inspection.add("unit", file.said.metres_per_unit > 0 ? "as the file says, here in metres"
                                                       : "taken for metres: the file does not say");
  inspection.add("up axis", file.said.up != '\0' ? "as the file says, here Y"
                                                 : "taken for Y: the file does not say");
  if (auto finding = unit_finding(file, place)) {
    finding->advice = "convert IN OUT " + finding->advice;
    inspection.findings.push_back(std::move(*finding));
  }
  inspection.add("vertices", s.vertices);
  inspection.add("triangles", s.faces);
  inspection.add("edges", s.edges);
  inspection.add("components", s.components);
  inspection.add("boundary loops", s.boundary_loops);
  inspection.add("lowest", numbers(s.lowest), "m");
  inspection.add("highest", numbers(s.highest), "m");
  inspection.add("area", s.area, "m2");
  if (s.volume) {
    inspection.add("volume", *s.volume, "m3");
  } else {
    inspection.add("volume", nullptr);
  }
  if (!s.edge_lengths.empty()) {
    inspection.add("shortest edge", s.edge_lengths.front(), "m");
    inspection.add("longest edge", s.edge_lengths.back(), "m");
  }
  std::string attributes;
  const auto attribute = [&](const char* name, bool there) {
    attributes += there ? (attributes.empty() ? "" : ", ") + std::string(name) : "";
  };
  attribute("normals", mesh.normals.rows() > 0);
  attribute("colours", mesh.colors.rows() > 0);
  attribute("texture coordinates", mesh.uvs.rows() > 0);
  attribute("labels", !mesh.labels.empty());
  attribute("confidence", mesh.confidence.size() > 0);
  inspection.add("attributes", attributes.empty() ? "none" : attributes);
  inspection.findings.insert(inspection.findings.end(), file.findings.begin(), file.findings.end());
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  std::vector<Finding> defects = findings_of(manifold_defects(topology), topology);
  for (Finding& defect : defects) {
    if (parted && defect.code == "non-manifold-vertex") {  // two seams that meet leave one
      defect.severity = Severity::Warning;
      defect.advice =
          "nothing where texture or normals have seams, along which this format parts vertices; "
          "else " +
          defect.advice;
    }
  }
  inspection.findings.insert(inspection.findings.end(), defects.begin(), defects.end());
  if (s.flat_faces > 0) {
    inspection.findings.push_back(
        {Severity::Warning, "flat-face", "face " + std::to_string(s.first_flat_face),
         counted(s.flat_faces, "face") + " without area, this one the first",
         "remove them, or join their vertices: nothing has a normal there"});
  }
  const Index unused = s.isolated_vertices;
  // Clouds of points are meshes without a face, but hardly as an OBJ.
  const bool has_faces = mesh.faces.rows() > 0 || lower_extension(place) == ".obj";
  if (has_faces && 2 * unused > mesh.vertices.rows()) {
    inspection.findings.push_back(
        {Severity::Warning, "mesh-cut-off", place,
         std::to_string(unused) + " of " + std::to_string(mesh.vertices.rows()) +
             " vertices are in no face: the file is possibly cut off, where faces come last",
         "compare it with where it came from"});
  }
}

const char* path_name(GltfPath path) {
  return path == GltfPath::Translation ? "translation"
         : path == GltfPath::Rotation  ? "rotation"
         : path == GltfPath::Scale     ? "scale"
                                       : "weights";
}

}  // namespace

void inspect_mesh(const std::filesystem::path& path, Inspection& inspection) {
  add_mesh(read_mesh_file(path), path.string(), false, inspection);
}

void inspect_usd_mesh(const std::filesystem::path& path, Inspection& inspection) {
  const UsdMesh usd = read_usd_mesh(path);
  const MeshConvention said{.metres_per_unit = 1, .up = 'y'};  // USD says both
  add_mesh({usd.mesh, said, usd.findings}, path.string(), true, inspection);
  inspection.add("frames", usd.frames.size());
  if (!usd.times.empty()) {
    inspection.add("first frame", usd.times.front());
    inspection.add("last frame", usd.times.back());
    inspection.add("fps", usd.fps, "1/s");
  }
}

void inspect_scene(const std::filesystem::path& path, Inspection& inspection) {
  const GltfScene scene = read_scene(path);
  if (!scene.meshes.empty()) {
    add_mesh(mesh_of_scene(scene, path.string()), path.string(), true, inspection);
  } else {
    inspection.findings = scene.findings;
    inspection.add("kind", "scene without a mesh");
  }
  inspection.add("nodes", scene.nodes.size());
  inspection.add("meshes", scene.meshes.size());
  inspection.add("skins", scene.skins.size());
  inspection.add("animations", scene.animations.size());
  for (std::size_t i = 0; i < scene.skins.size(); ++i) {
    nlohmann::ordered_json joints = nlohmann::ordered_json::array();
    for (const int joint : scene.skins[i].joints) {
      joints.push_back(scene.nodes[static_cast<std::size_t>(joint)].name);
    }
    inspection.add_member(
        "skin " + std::to_string(i),
        {{"name", scene.skins[i].name}, {"joints", joints.size()}, {"joint_names", joints}});
  }
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    const GltfMesh& mesh = scene.meshes[i];
    const std::size_t targets =
        mesh.primitives.empty() ? 0 : mesh.primitives.front().targets.size();
    nlohmann::ordered_json facts = {
        {"name", mesh.name}, {"primitives", mesh.primitives.size()}, {"morph_targets", targets}};
    if (!mesh.target_names.empty()) {
      facts["morph_target_names"] = mesh.target_names;
    }
    inspection.add_member("mesh " + std::to_string(i), facts);
  }
  for (std::size_t i = 0; i < scene.animations.size(); ++i) {
    const GltfAnimation& animation = scene.animations[i];
    double seconds = 0;
    std::size_t keys = 0;
    nlohmann::ordered_json moved = nlohmann::ordered_json::object();
    for (const GltfChannel& channel : animation.channels) {
      seconds = std::max(seconds, channel.times.back());
      keys = std::max(keys, channel.times.size());
      moved[path_name(channel.path)] = moved.value(path_name(channel.path), 0) + 1;
    }
    inspection.add_member(
        "animation " + std::to_string(i),
        {{"name", animation.name}, {"seconds", seconds}, {"most_keys", keys}, {"channels", moved}});
  }
}

}  // namespace atelier
