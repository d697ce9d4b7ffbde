#include "registration/flattening/seam_input.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "core/file_kind.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/limits.h"
#include "core/printable.h"
#include "core/unknown_value.h"
#include "registration/flattening/surface_cut.h"

namespace atelier {
namespace {

using nlohmann::json;

/// Whether any triangle of the texture has an area.
bool have_area(const Mesh& mesh) {
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    const Eigen::Vector2d a = mesh.uvs.row(mesh.uv_faces(f, 0));
    const Eigen::Vector2d ab = mesh.uvs.row(mesh.uv_faces(f, 1)).transpose() - a;
    const Eigen::Vector2d ac = mesh.uvs.row(mesh.uv_faces(f, 2)).transpose() - a;
    if (ab.x() * ac.y() != ab.y() * ac.x()) {
      return true;
    }
  }
  return false;
}

std::vector<char> cut_at_uvs(const Mesh& mesh, const Topology& topology,
                             const std::filesystem::path& file) {
  if (mesh.uv_faces.rows() != mesh.faces.rows()) {
    throw DataError(file.string(), "texture coordinates", "none", "some, or other --seams");
  }
  if (!have_area(mesh)) {
    throw DataError(file.string(), "texture coordinates", "no area: no triangle has a place",
                    "a layout of the panels, or other --seams");
  }
  std::vector<char> cut(static_cast<std::size_t>(topology.edges.rows()), 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    if (sharing.size() != 2) {
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) {
        const int a = sharing[0] / 3;
        const int b = sharing[1] / 3;
        const int vertex = mesh.faces(a, k);
        const bool shared = vertex == mesh.faces(b, l) &&
                            (vertex == topology.edges(e, 0) || vertex == topology.edges(e, 1));
        if (shared && mesh.uvs.row(mesh.uv_faces(a, k)) != mesh.uvs.row(mesh.uv_faces(b, l))) {
          cut[static_cast<std::size_t>(e)] = 1;
        }
      }
    }
  }
  return cut;
}

std::vector<char> cut_at_labels(const Mesh& mesh, const Topology& topology,
                                const std::filesystem::path& file) {
  if (mesh.labels.empty()) {
    throw DataError(file.string(), "labels", "none", "a mesh with labels (.ply), or other --seams");
  }
  std::vector<int> labels;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const auto label = [&](int k) {
      return mesh.labels[static_cast<std::size_t>(mesh.faces(f, k))];
    };
    labels.push_back(label(1) == label(2) ? label(1) : label(0));
  }
  return cut_between_labels(topology, labels);
}

int integer_at(const json& value, std::int64_t count, const std::string& file,
               const std::string& where) {
  if (!value.is_number_integer() || value.get<std::int64_t>() < 0 ||
      value.get<std::int64_t>() >= count) {
    throw DataError(file, where, value.dump().substr(0, 40),
                    "a whole number from 0 to " + std::to_string(count - 1));
  }
  return static_cast<int>(value.get<std::int64_t>());
}

/// Seams of a mesh in a JSON text.
struct SeamDocument {
  std::vector<std::pair<int, int>> edges;  ///< ends of those that are cut
  std::optional<std::vector<int>> panels;  ///< of each triangle
};

/// @param triangles  of the mesh; none: as many as there are panels
SeamDocument parse_seam_document(std::string_view text, Index vertices,
                                 std::optional<Index> triangles, const std::string& file) {
  const json root = parse_json(text, file);
  if (!root.is_object() || (!root.contains("seams") && !root.contains("panels"))) {
    throw DataError(file, "", "neither \"seams\" nor \"panels\"",
                    "{\"seams\": [[v0, v1, ...], ...]} or {\"panels\": [...]}");
  }
  SeamDocument document;
  if (root.contains("seams")) {
    if (!root["seams"].is_array()) {
      throw DataError(file, "seams", root["seams"].type_name(), "a list of lists of vertices");
    }
    for (std::size_t s = 0; s < root["seams"].size(); ++s) {
      const json& run = root["seams"][s];
      const std::string where = "seams[" + std::to_string(s) + "]";
      if (!run.is_array() || run.size() < 2) {
        throw DataError(file, where, run.dump().substr(0, 40), "a list of two vertices or more");
      }
      for (std::size_t i = 1; i < run.size(); ++i) {
        const int a = integer_at(run[i - 1], vertices, file, where);
        const int b = integer_at(run[i], vertices, file, where);
        if (a == b) {
          throw DataError(file, where, "vertex " + std::to_string(a) + " behind itself",
                          "the other end of an edge");
        }
        document.edges.emplace_back(a, b);
      }
    }
  }
  if (root.contains("panels")) {
    const json& panels = root["panels"];
    const Index count = panels.is_array() ? static_cast<Index>(panels.size()) : 0;
    if (!panels.is_array() || count != triangles.value_or(count)) {
      throw DataError(
          file, "panels",
          panels.is_array() ? counted(count, "number") : std::string(panels.type_name()),
          "a number for each of " + (triangles ? std::to_string(*triangles) : "its") +
              " triangles");
    }
    document.panels.emplace();
    for (std::size_t f = 0; f < panels.size(); ++f) {
      document.panels->push_back(
          integer_at(panels[f], count, file, "panels[" + std::to_string(f) + "]"));
    }
  }
  return document;
}

}  // namespace

void require_seams_named(const std::string& seams) {
  if (seams == "auto" || seams == "uvs" || seams == "labels" || seams == "none" ||
      file_kind(seams) != std::filesystem::file_type::not_found) {
    return;
  }
  throw UnknownValue("", "seams", seams, "auto, uvs, labels, none, or a file (.json)");
}

std::vector<char> seam_input(const std::string& seams, const Mesh& mesh, const Topology& topology,
                             const std::filesystem::path& mesh_file) {
  require_seams_named(seams);
  if (seams == "uvs") {
    return cut_at_uvs(mesh, topology, mesh_file);
  }
  if (seams == "labels") {
    return cut_at_labels(mesh, topology, mesh_file);
  }
  if (seams != "auto" && seams != "none") {
    return parse_seams(read_file_text(seams, Limits{}.text_file_bytes), mesh, topology, seams);
  }
  return std::vector<char>(static_cast<std::size_t>(topology.edges.rows()), 0);
}

std::vector<char> parse_seams(std::string_view text, const Mesh& mesh, const Topology& topology,
                              const std::string& file) {
  const SeamDocument document =
      parse_seam_document(text, mesh.vertices.rows(), mesh.faces.rows(), file);
  std::vector<char> cut(static_cast<std::size_t>(topology.edges.rows()), 0);
  try {
    cut = cut_at_edges(topology, document.edges);
  } catch (const DataError& error) {
    throw DataError(file, error.where, error.found, error.expected);
  }
  if (document.panels) {
    const std::vector<char> between = cut_between_labels(topology, *document.panels);
    for (std::size_t e = 0; e < cut.size(); ++e) {
      cut[e] = static_cast<char>(cut[e] | between[e]);
    }
  }
  return cut;
}

void check_seams(const std::string& text, const std::string& file) {
  parse_seam_document(text, static_cast<Index>(Limits{}.mesh_vertices), std::nullopt, file);
}

}  // namespace atelier
