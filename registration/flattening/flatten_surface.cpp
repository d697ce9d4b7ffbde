#include "registration/flattening/flatten_surface.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/io/mesh_file.h"
#include "core/printable.h"
#include "core/topology.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/flattening/flatten_diagnostics.h"
#include "registration/flattening/needless_triangles.h"
#include "registration/flattening/rest_surface.h"
#include "registration/flattening/seam_input.h"
#include "registration/loose_vertices.h"
#include "registration/orient_faces.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Refuses what has no area, or is so small that the pattern's files, in micrometres, would not
/// hold it.
void require_extent(const Mesh& mesh, const std::string& file) {
  constexpr double kSmallest = 0.001;  // m
  const Mesh used = without_loose_vertices(mesh);
  if (used.faces.rows() == 0) {
    return;  // said by check_flattenable
  }
  const double extent =
      (used.vertices.colwise().maxCoeff() - used.vertices.colwise().minCoeff()).maxCoeff();
  if (extent < kSmallest) {
    char text[80];
    std::snprintf(text, sizeof text, "a mesh of %.4g m", extent);
    throw DataError(file, "size", text,
                    "1 mm at least, a garment's size: --input.unit says the file's unit");
  }
  for (Index f = 0; f < used.faces.rows(); ++f) {
    const auto corner = [&](int k) { return used.vertices.row(used.faces(f, k)).transpose(); };
    if (!is_without_area(corner(0), corner(1), corner(2))) {
      return;
    }
  }
  throw DataError(file, "mesh", "no triangle with an area", "a garment's surface");
}

/// Flags of edges as those of another mesh of the same vertices, which has no edge that is not in
/// the first; edges of one triangle are no seam.
std::vector<char> flags_of(const Topology& topology, const Topology& whole,
                           const std::vector<char>& flags) {
  std::vector<char> result(static_cast<std::size_t>(topology.edges.rows()), 0);
  Index at = 0;
  for (Index e = 0; e < topology.edges.rows(); ++e) {  // both in lexicographic order
    while (whole.edges.row(at) != topology.edges.row(e)) {
      ++at;
    }
    if (corners_of_edge(topology, e).size() == 2) {
      result[static_cast<std::size_t>(e)] = flags[static_cast<std::size_t>(at)];
    }
  }
  return result;
}

/// Of faces that agree on what is outside as far as they can: refuses those that cannot. Edges of
/// three triangles are refused elsewhere.
void require_two_sides(const Topology& topology, const std::string& file) {
  const ManifoldDefects defects = manifold_defects(topology);
  if (!defects.inconsistent_edges.empty() && defects.non_manifold_edges.empty()) {
    const int edge = defects.inconsistent_edges.front();
    throw DataError(
        file,
        "edge of vertices " + std::to_string(topology.edges(edge, 0)) + " and " +
            std::to_string(topology.edges(edge, 1)),
        "a one-sided surface such as a Moebius strip: its triangles have no consistent orientation",
        "an orientable surface: cut it open there");
  }
}

}  // namespace

FlattenSurface read_flatten_surface(const fs::path& file, const std::string& seams,
                                    const MeshConvention& convention,
                                    const FlattenWatcher& watcher) {
  FlattenSurface surface;
  MeshFile read = read_mesh_file(file, convention);
  require_extent(read.mesh, file.string());
  surface.mesh = without_needless_triangles(read.mesh);
  if (const Index needless = read.mesh.faces.rows() - surface.mesh.faces.rows(); needless > 0) {
    watcher.warn({Severity::Warning, "triangles-left-out", file.string(),
                  counted(needless, "triangle") + " without area, or there already",
                  "left out; the surface is the same"});
  }
  const Triangles oriented =
      consistently_oriented(surface.mesh.faces, surface.mesh.vertices.rows());
  if (oriented != surface.mesh.faces) {
    watcher.say("triangles of opposite orientation were reversed");
    for (Index f = 0; f < surface.mesh.uv_faces.rows(); ++f) {
      if (oriented.row(f) != surface.mesh.faces.row(f)) {
        std::swap(surface.mesh.uv_faces(f, 1), surface.mesh.uv_faces(f, 2));
      }
    }
    surface.mesh.faces = oriented;
  }
  const Topology topology = topology_of(surface.mesh.faces, surface.mesh.vertices.rows());
  require_two_sides(topology, file.string());
  check_flattenable(surface.mesh, file.string());
  const bool words = seams == "uvs" || seams == "labels";
  // A file counts all triangles.
  const Topology whole = words ? topology : topology_of(read.mesh.faces, read.mesh.vertices.rows());
  surface.seams =
      flags_of(topology, whole, seam_input(seams, words ? surface.mesh : read.mesh, whole, file));
  if (words && std::find(surface.seams.begin(), surface.seams.end(), 1) == surface.seams.end()) {
    watcher.say((seams == "uvs" ? "texture coordinates" : "labels") +
                std::string(" part nowhere: no seam is given"));
  }
  const Index vertices = surface.mesh.vertices.rows();
  surface.mesh = without_loose_vertices(surface.mesh);  // seams of files count all of them
  if (const Index loose = vertices - surface.mesh.vertices.rows(); loose > 0) {
    watcher.say(std::to_string(loose) + (loose == 1
                                             ? " vertex without a triangle was left out"
                                             : " vertices without a triangle were left out"));
  }
  read.mesh.vertices = surface.mesh.vertices;
  if (const auto doubt = garment_size_finding(read, file.string())) {
    watcher.warn(*doubt);
  }
  return surface;
}

fs::path template_file(const fs::path& mesh) {
  const fs::path beside = mesh.parent_path() / kTemplateFile;
  std::error_code ignored;
  const fs::path folder = fs::weakly_canonical(fs::absolute(mesh, ignored).parent_path(), ignored);
  return file_kind(beside) == fs::file_type::not_found && folder.filename() == kTemplateGarments
             ? folder.parent_path() / kTemplateFile
             : beside;
}

TemplateNote template_note(const fs::path& file, const std::string& label) {
  TemplateNote note;
  if (file_kind(file) == fs::file_type::not_found) {
    return note;
  }
  const nlohmann::json all = read_json(file);
  if (!all.is_object() || !all.contains("garments") || !all["garments"].is_array()) {
    return note;  // another file of that name
  }
  for (const JsonPlace& one : JsonPlace(all, file.string()).items("garments")) {
    if (!one.value().is_object() || !one.has("label") || one.at("label").value() != label) {
      continue;
    }
    if (const std::optional<JsonPlace> facing = one.find("facing")) {
      const std::vector<double> along = facing->numbers();
      if (along.size() != 3) {
        facing->fail(std::to_string(along.size()) + " numbers", "3: x, y and z");
      }
      const Eigen::Vector3d level(along[0], 0, along[2]);
      note.facing = level.norm() > 1e-6 ? Eigen::Vector3d(level.normalized()) : note.facing;
    }
    if (const std::optional<JsonPlace> frame = one.find("frame")) {
      note.frame = static_cast<int>(frame->integer(0, std::numeric_limits<int>::max()));
    }
    note.rest = one.boolean_or(one.has("taut") ? "taut" : "rest", false);  // as it was once called
  }
  return note;
}

bool is_rest(const FlattenGarment& garment) {
  return garment.note.rest || garment.file.filename() == kRestFile ||
         garment.file.filename() == kFormerRestFile ||
         template_note(template_file(garment.file), garment.file.stem().string()).rest;
}

}  // namespace atelier
