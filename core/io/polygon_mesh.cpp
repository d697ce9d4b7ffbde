#include "core/io/polygon_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "core/cross.h"
#include "core/error.h"

namespace atelier {
namespace {

struct Unit {
  const char* name;
  double metres;
};

constexpr std::size_t kCutName = 4;  // letters that tell long names apart

constexpr Unit kUnits[] = {{"m", 1},
                           {"dm", 0.1},
                           {"cm", 0.01},
                           {"mm", 0.001},
                           {"in", 0.0254},
                           {"ft", 0.3048},
                           {"ins", 0.0254},
                           {"yd", 0.9144},
                           {"km", 1000},
                           {"um", 1e-6},
                           {"mtr", 1},
                           {"mtrs", 1},
                           {"cms", 0.01},
                           {"mms", 0.001},
                           {"metre", 1},
                           {"metres", 1},
                           {"meter", 1},
                           {"meters", 1},
                           {"decimetre", 0.1},
                           {"decimetres", 0.1},
                           {"decimeter", 0.1},
                           {"decimeters", 0.1},
                           {"centimetre", 0.01},
                           {"centimetres", 0.01},
                           {"centimeter", 0.01},
                           {"centimeters", 0.01},
                           {"millimetre", 0.001},
                           {"millimetres", 0.001},
                           {"millimeter", 0.001},
                           {"millimeters", 0.001},
                           {"inch", 0.0254},
                           {"inches", 0.0254},
                           {"foot", 0.3048},
                           {"feet", 0.3048},
                           {"yard", 0.9144},
                           {"yards", 0.9144}};

using Corner = int;  // of a polygon, from 0
using Ear = std::array<Corner, 3>;

/// Twice the signed area.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return cross(b - a, c - b);
}

bool inside(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
            const Eigen::Vector2d& c) {
  return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

/// The polygon's corners in the plane of its Newell normal, counter-clockwise.
std::vector<Eigen::Vector2d> flattened(const Points& vertices, std::span<const int> polygon) {
  const std::size_t n = polygon.size();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = vertices.row(polygon[0]).transpose();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d a = vertices.row(polygon[i]).transpose() - origin;
    const Eigen::Vector3d b = vertices.row(polygon[(i + 1) % n]).transpose() - origin;
    normal += a.cross(b);
  }
  // Dropping the normal's largest component keeps exact zeros exact; the sign keeps the turn.
  int drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  const int u = (drop + 1) % 3;
  const int v = (drop + 2) % 3;
  const double sign = normal[drop] < 0 ? -1 : 1;
  std::vector<Eigen::Vector2d> flat(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d p = vertices.row(polygon[i]).transpose() - origin;
    flat[i] = {sign * p[u], p[v]};
  }
  return flat;
}

/// n - 2 triangles of corners.
class EarClipper {
 public:
  explicit EarClipper(std::vector<Eigen::Vector2d> flat) : flat_(std::move(flat)) {
    const int n = static_cast<int>(flat_.size());
    next_.resize(flat_.size());
    previous_.resize(flat_.size());
    for (int i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
    }
  }

  bool convex() const {
    for (std::size_t i = 0; i < flat_.size(); ++i) {
      if (corner_turn(static_cast<int>(i)) < 0) {
        return false;
      }
    }
    return true;
  }

  std::vector<Ear> clip() {
    const int n = static_cast<int>(flat_.size());
    std::vector<Ear> ears;
    std::vector<char> is_ear(flat_.size());
    for (int i = 0; i < n; ++i) {
      is_ear[i] = ear(i);
    }
    int at = 0;
    int rounds_without = 0;
    for (int left = n; left > 3;) {
      if (is_ear[at] == 0 && rounds_without < left) {
        at = next_[at];
        ++rounds_without;
        continue;
      }
      if (is_ear[at] == 0) {
        break;  // the polygon crosses itself or has no area
      }
      const int before = previous_[at];
      const int after = next_[at];
      ears.push_back({before, at, after});
      next_[before] = after;
      previous_[after] = before;
      --left;
      rounds_without = 0;
      is_ear[before] = ear(before);
      is_ear[after] = ear(after);
      at = after;
    }
    // A triangle, or what cannot be cut: a fan.
    for (int a = next_[at], b = next_[a]; b != at; a = b, b = next_[b]) {
      ears.push_back({at, a, b});
    }
    return ears;
  }

 private:
  double corner_turn(int i) const { return turn(flat_[previous_[i]], flat_[i], flat_[next_[i]]); }

  bool ear(int i) const {
    if (corner_turn(i) <= 0) {
      return false;
    }
    const Eigen::Vector2d& a = flat_[previous_[i]];
    const Eigen::Vector2d& b = flat_[i];
    const Eigen::Vector2d& c = flat_[next_[i]];
    for (int j = next_[next_[i]]; j != previous_[i]; j = next_[j]) {
      const Eigen::Vector2d& p = flat_[j];
      if (p != a && p != b && p != c && inside(p, a, b, c)) {
        return false;
      }
    }
    return true;
  }

  std::vector<Eigen::Vector2d> flat_;
  std::vector<int> next_;
  std::vector<int> previous_;
};

void cut(const Points& vertices, std::span<const int> polygon, std::vector<Ear>& ears) {
  const int n = static_cast<int>(polygon.size());
  ears.clear();
  if (n > 3) {
    EarClipper clipper(flattened(vertices, polygon));
    if (!clipper.convex()) {
      ears = clipper.clip();
      return;
    }
  }
  for (int i = 1; i + 1 < n; ++i) {
    ears.push_back({0, i, i + 1});
  }
}

void check_indices(const std::vector<int>& indices, Index count, int lowest, const char* what) {
  for (const int index : indices) {
    ATELIER_CHECK(index >= lowest && index < count, std::string(what) + " index out of range");
  }
}

bool all_set(const std::vector<int>& indices, std::size_t count) {
  return indices.size() == count && count > 0 &&
         std::none_of(indices.begin(), indices.end(), [](int i) { return i < 0; });
}

/// One normal per vertex, or nothing if some vertex has none or two.
Points one_normal_each(const PolygonMesh& polygons) {
  const Index count = polygons.vertices.rows();
  std::vector<int> normal_of(static_cast<std::size_t>(count), -1);
  for (std::size_t c = 0; c < polygons.corner_vertices.size(); ++c) {
    int& normal = normal_of[polygons.corner_vertices[c]];
    const int here = polygons.corner_normals[c];
    if (normal >= 0 && normal != here &&
        polygons.normals.row(normal) != polygons.normals.row(here)) {
      return {};
    }
    normal = here;
  }
  Points normals(count, 3);
  for (Index v = 0; v < count; ++v) {
    if (normal_of[v] < 0) {
      return {};
    }
    normals.row(v) = polygons.normals.row(normal_of[v]);
  }
  return make_unit_rows(normals) ? normals : Points();
}

}  // namespace

void check_polygons(const PolygonMesh& mesh) {
  const std::vector<int>& starts = mesh.polygon_starts;
  const std::size_t corners = mesh.corner_vertices.size();
  ATELIER_CHECK(!starts.empty() && starts.front() == 0 && std::cmp_equal(starts.back(), corners),
                "polygon_starts do not span the corners");
  for (std::size_t p = 0; p + 1 < starts.size(); ++p) {
    ATELIER_CHECK(starts[p + 1] - starts[p] >= 3, "a polygon needs 3 corners");
  }
  const auto agrees = [](std::size_t rows, std::size_t expected) {
    return rows == 0 || rows == expected;
  };
  const std::size_t vertices = static_cast<std::size_t>(mesh.vertices.rows());
  ATELIER_CHECK(
      agrees(mesh.colors.rows(), vertices) && agrees(mesh.vertex_normals.rows(), vertices) &&
          agrees(mesh.labels.size(), vertices) && agrees(mesh.confidence.size(), vertices),
      "an attribute with more or fewer rows than vertices");
  ATELIER_CHECK(
      agrees(mesh.corner_uvs.size(), corners) && agrees(mesh.corner_normals.size(), corners),
      "an attribute with more or fewer entries than corners");
  const std::size_t polygons = starts.size() - 1;
  ATELIER_CHECK(agrees(mesh.polygon_groups.size(), polygons) &&
                    agrees(mesh.polygon_objects.size(), polygons) &&
                    agrees(mesh.polygon_materials.size(), polygons),
                "an attribute with more or fewer entries than polygons");
  check_indices(mesh.corner_vertices, mesh.vertices.rows(), 0, "vertex");
  check_indices(mesh.corner_uvs, mesh.uvs.rows(), -1, "uv");
  check_indices(mesh.corner_normals, mesh.normals.rows(), -1, "normal");
  check_indices(mesh.polygon_groups, std::ssize(mesh.group_names), -1, "group");
  check_indices(mesh.polygon_objects, std::ssize(mesh.object_names), -1, "object");
  check_indices(mesh.polygon_materials, std::ssize(mesh.material_names), -1, "material");
}

Mesh triangulated(const PolygonMesh& polygons) {
  check_polygons(polygons);
  const std::vector<int>& starts = polygons.polygon_starts;
  const std::size_t corners = polygons.corner_vertices.size();
  Mesh mesh;
  mesh.vertices = polygons.vertices;
  mesh.colors = polygons.colors;
  mesh.labels = polygons.labels;
  mesh.confidence = polygons.confidence;
  mesh.normals = polygons.vertex_normals;
  if (mesh.normals.rows() == 0 && all_set(polygons.corner_normals, corners)) {
    mesh.normals = one_normal_each(polygons);
  }
  const bool with_uvs = all_set(polygons.corner_uvs, corners);
  if (with_uvs) {
    mesh.uvs = polygons.uvs;
  }

  const Index count = polygon_count(polygons);
  mesh.faces.resize(static_cast<Index>(corners) - 2 * count, 3);
  if (with_uvs) {
    mesh.uv_faces.resize(mesh.faces.rows(), 3);
  }
  std::vector<Ear> ears;
  Index face = 0;
  for (Index p = 0; p < count; ++p) {
    const int start = starts[p];
    const int size = starts[p + 1] - start;
    cut(polygons.vertices, std::span<const int>(polygons.corner_vertices).subspan(start, size),
        ears);
    for (const Ear& ear : ears) {
      for (int i = 0; i < 3; ++i) {
        const int corner = start + ear[i];
        mesh.faces(face, i) = polygons.corner_vertices[corner];
        if (with_uvs) {
          mesh.uv_faces(face, i) = polygons.corner_uvs[corner];
        }
      }
      ++face;
    }
  }
  return mesh;
}

PolygonMesh polygons_of(const Mesh& mesh) {
  PolygonMesh polygons;
  polygons.vertices = mesh.vertices;
  polygons.colors = mesh.colors;
  polygons.vertex_normals = mesh.normals;
  polygons.labels = mesh.labels;
  polygons.confidence = mesh.confidence;
  polygons.uvs = mesh.uvs;
  const Index faces = mesh.faces.rows();
  polygons.polygon_starts.resize(static_cast<std::size_t>(faces) + 1);
  for (Index f = 0; f <= faces; ++f) {
    polygons.polygon_starts[f] = static_cast<int>(3 * f);
  }
  polygons.corner_vertices.assign(mesh.faces.data(), mesh.faces.data() + mesh.faces.size());
  polygons.corner_uvs.assign(mesh.uv_faces.data(), mesh.uv_faces.data() + mesh.uv_faces.size());
  polygons.convention = {.metres_per_unit = 1, .up = 'y'};
  return polygons;
}

Mesh in_metres_y_up(Mesh mesh, const MeshConvention& said, const MeshConvention& otherwise) {
  const double unit = said.metres_per_unit > 0 ? said.metres_per_unit : otherwise.metres_per_unit;
  const char up = said.up != '\0' ? said.up : otherwise.up;
  ATELIER_CHECK(unit > 0 && std::isfinite(unit), "metres_per_unit must be positive");
  ATELIER_CHECK(up == 'x' || up == 'y' || up == 'z', "up must be x, y or z");
  Eigen::Matrix3d y_up_from_file = Eigen::Matrix3d::Identity();
  if (up == 'z') {
    y_up_from_file << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  } else if (up == 'x') {
    y_up_from_file << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  }
  if (unit != 1) {
    mesh.vertices *= unit;
  }
  if (up != 'y') {
    mesh.vertices = (mesh.vertices * y_up_from_file.transpose()).eval();
    mesh.normals = (mesh.normals * y_up_from_file.transpose()).eval();
  }
  return mesh;
}

std::string convention_comments(const MeshConvention& convention, const std::string& prefix) {
  std::string text;
  for (const Unit& unit : kUnits) {
    if (unit.metres == convention.metres_per_unit) {
      text += prefix + "units: " + unit.name + '\n';
      break;
    }
  }
  if (convention.up != '\0') {
    text += prefix + "up: " + convention.up + '\n';
  }
  return text;
}

bool make_unit_rows(Points& normals) {
  for (Index i = 0; i < normals.rows(); ++i) {
    const double length = normals.row(i).norm();
    if (!(length > 0) || !std::isfinite(length)) {
      return false;
    }
    if (std::abs(length - 1) > 1e-6) {
      normals.row(i) /= length;
    }
  }
  return true;
}

OptionTable describe(MeshConvention& convention) {
  OptionTable table;
  std::vector<std::pair<std::string, double>> units;
  for (const char* name : {"m", "dm", "cm", "mm", "in", "ft"}) {
    units.emplace_back(name, metres_of_unit(name));
  }
  table.add("unit", convention.metres_per_unit, units,
            "Length unit of mesh files that do not state theirs");
  table.add("up", convention.up, {{"x", 'x'}, {"y", 'y'}, {"z", 'z'}},
            "Up axis of mesh files that do not state theirs");
  return table;
}

double metres_of_unit(const std::string& name) {
  std::string plain;
  for (const char c : name) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (std::string_view(" \t\r.()[]\"'").find(c) == std::string_view::npos) {
      return 0;
    }
  }
  for (const Unit& unit : kUnits) {
    const bool cut = plain.size() >= kCutName && std::string_view(unit.name).starts_with(plain);
    if (plain == unit.name || cut) {
      return unit.metres;
    }
  }
  return 0;
}

void read_convention(const std::string& comment, MeshConvention& convention) {
  std::string text = comment;
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto value_of = [&](const std::string& key) -> std::string {
    const std::size_t begin = text.find_first_not_of(" \t#");
    if (begin == std::string::npos || text.compare(begin, key.size(), key) != 0) {
      return "";
    }
    const std::size_t first = text.find_first_not_of(" \t", begin + key.size());
    const std::size_t last = text.find_last_not_of(" \t\r");
    return first == std::string::npos ? "" : text.substr(first, last - first + 1);
  };
  const std::string unit = value_of("units:");
  if (!unit.empty()) {
    convention.metres_per_unit = metres_of_unit(unit);
  }
  const std::string up = value_of("up:");
  if (up == "x" || up == "y" || up == "z") {
    convention.up = up.front();
  }
}

}  // namespace atelier
