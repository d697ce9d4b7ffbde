#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/mesh_obj.h"
#include "core/io/srgb.h"
#include "core/io/text_writer.h"

namespace atelier {
namespace {

/// The one table of normals that OBJ has: the vertices' own, or those of the corners.
struct NormalTable {
  const Points* rows = nullptr;
  const std::vector<int>* corners = nullptr;
};

NormalTable normals_to_write(const PolygonMesh& mesh) {
  if (mesh.vertex_normals.rows() > 0) {
    return {&mesh.vertex_normals, &mesh.corner_vertices};
  }
  return {&mesh.normals, &mesh.corner_normals};
}

void append_row(std::string& text, const char* word, const double* values, int count) {
  text += word;
  for (int i = 0; i < count; ++i) {
    text += ' ';
    append_number(text, values[i]);
  }
}

void append_line(std::string& text, const char* word, const std::string& name) {
  ATELIER_CHECK(name.find_first_of("\r\n") == std::string::npos && !name.ends_with('\\'),
                "a name with a line break, or a backslash at its end");
  text += word;
  text += ' ' + name + '\n';
}

/// "g name" and the like, where the name differs from the polygon before.
void append_name(std::string& text, const char* word, const std::vector<int>& of_polygon,
                 const std::vector<std::string>& names, Index polygon) {
  if (of_polygon.empty()) {
    return;
  }
  const int name = of_polygon[polygon];
  const int before = polygon > 0 ? of_polygon[polygon - 1] : -1;
  if (name != before) {
    ATELIER_CHECK(name >= 0, "a polygon without a name behind one that has one");
    append_line(text, word, names[name]);
  }
}

}  // namespace

std::string obj_text(const PolygonMesh& mesh) {
  check_polygons(mesh);
  const NormalTable normals = normals_to_write(mesh);
  std::string text = convention_comments(mesh.convention, "# ");
  for (const std::string& file : mesh.material_files) {
    append_line(text, "mtllib", file);
  }
  for (Index i = 0; i < mesh.vertices.rows(); ++i) {
    append_row(text, "v", mesh.vertices.row(i).data(), 3);
    for (int c = 0; c < 3 && mesh.colors.rows() > 0; ++c) {
      text += ' ';
      append_number(text, srgb_from_linear(mesh.colors(i, c)));
    }
    text += '\n';
  }
  for (Index i = 0; i < mesh.uvs.rows(); ++i) {
    append_row(text, "vt", mesh.uvs.row(i).data(), 2);
    text += '\n';
  }
  for (Index i = 0; i < normals.rows->rows(); ++i) {
    append_row(text, "vn", normals.rows->row(i).data(), 3);
    text += '\n';
  }
  for (Index p = 0; p < polygon_count(mesh); ++p) {
    append_name(text, "o", mesh.polygon_objects, mesh.object_names, p);
    append_name(text, "g", mesh.polygon_groups, mesh.group_names, p);
    append_name(text, "usemtl", mesh.polygon_materials, mesh.material_names, p);
    text += 'f';
    for (int c = mesh.polygon_starts[p]; c < mesh.polygon_starts[p + 1]; ++c) {
      const int uv = mesh.corner_uvs.empty() ? -1 : mesh.corner_uvs[c];
      const int normal = normals.corners->empty() ? -1 : (*normals.corners)[c];
      text += ' ';
      append_number(text, mesh.corner_vertices[c] + 1);
      if (uv >= 0 || normal >= 0) {
        text += '/';
      }
      if (uv >= 0) {
        append_number(text, uv + 1);
      }
      if (normal >= 0) {
        text += '/';
        append_number(text, normal + 1);
      }
    }
    text += '\n';
  }
  return text;
}

void write_obj(const std::filesystem::path& path, const PolygonMesh& mesh) {
  write_file_atomically(path, obj_text(mesh));
}

void write_obj(const std::filesystem::path& path, const Mesh& mesh) {
  write_obj(path, polygons_of(mesh));
}

}  // namespace atelier
