#include "bodymodel/formats/makehuman.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>

#include "bodymodel/formats/makehuman_rig.h"
#include "core/error.h"
#include "core/io/mesh_obj.h"

namespace atelier {
namespace {

constexpr const char* kBodyGroup = "body";
constexpr double kMaxMissing = 0.25;  // share of a body that macro targets may leave out

// Vertices that the polygons of each group use, increasing.
VertexGroups vertex_groups(const PolygonMesh& mesh) {
  std::vector<std::set<int>> used(mesh.group_names.size());
  for (Index p = 0; p < polygon_count(mesh) && !mesh.polygon_groups.empty(); ++p) {
    const std::size_t polygon = static_cast<std::size_t>(p);
    const int group = mesh.polygon_groups[polygon];
    if (group < 0) {
      continue;
    }
    for (int c = mesh.polygon_starts[polygon]; c < mesh.polygon_starts[polygon + 1]; ++c) {
      used[static_cast<std::size_t>(group)].insert(
          mesh.corner_vertices[static_cast<std::size_t>(c)]);
    }
  }
  VertexGroups groups;
  for (std::size_t g = 0; g < used.size(); ++g) {
    groups.push_back({mesh.group_names[g], {used[g].begin(), used[g].end()}});
  }
  return groups;
}

const std::vector<int>& body_vertices(const VertexGroups& groups, const std::string& file) {
  for (const VertexGroup& group : groups) {
    if (group.name == kBodyGroup) {
      return group.vertices;
    }
  }
  throw DataError(
      file, "groups", "no group 'body'",
      "MakeHuman's base mesh (hm08), the one .obj with joints; else a body model: female, "
      "male, .glb, .fbx or .npz");
}

// The faces of the body with vertices renumbered; uvs that nothing else uses go.
Mesh body_mesh(const PolygonMesh& polygons, const std::vector<int>& vertices, const Points& base) {
  const Mesh all = triangulated(polygons);
  std::vector<int> number(static_cast<std::size_t>(base.rows()), -1);
  Mesh body;
  body.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    number[static_cast<std::size_t>(vertices[v])] = static_cast<int>(v);
    body.vertices.row(static_cast<Index>(v)) = base.row(vertices[v]);
  }
  std::vector<Index> faces;
  // Polygon p of n corners gives n - 2 triangles in a row.
  Index face = 0;
  for (Index p = 0; p < polygon_count(polygons); ++p) {
    const std::size_t polygon = static_cast<std::size_t>(p);
    const int corners = polygons.polygon_starts[polygon + 1] - polygons.polygon_starts[polygon];
    const int group = polygons.polygon_groups[polygon];
    for (int k = 0; k < corners - 2; ++k, ++face) {
      if (group >= 0 && polygons.group_names[static_cast<std::size_t>(group)] == kBodyGroup) {
        faces.push_back(face);
      }
    }
  }
  const Index count = static_cast<Index>(faces.size());
  body.faces.resize(count, 3);
  const bool has_uvs = all.uv_faces.rows() == all.faces.rows();
  body.uv_faces.resize(has_uvs ? count : 0, 3);
  std::map<int, int> uv_number;
  for (Index f = 0; f < count; ++f) {
    for (int c = 0; c < 3; ++c) {
      body.faces(f, c) =
          number[static_cast<std::size_t>(all.faces(faces[static_cast<std::size_t>(f)], c))];
      if (has_uvs) {
        const int uv = all.uv_faces(faces[static_cast<std::size_t>(f)], c);
        body.uv_faces(f, c) =
            uv_number.emplace(uv, static_cast<int>(uv_number.size())).first->second;
      }
    }
  }
  body.uvs.resize(static_cast<Index>(uv_number.size()), 2);
  for (const auto& [from, to] : uv_number) {
    body.uvs.row(to) = all.uvs.row(from);
  }
  return body;
}

// Blends the macro targets into the base; says which files are missing.
void apply_macros(const MakeHumanFiles& files, const MakeHumanMacros& macros, Points& base,
                  std::vector<Finding>& findings, const Limits& limits) {
  if (files.macros.empty()) {
    return;
  }
  int missing = 0;
  double builds = 0;  // weight of those that make a whole body, which add up to 1
  double races = 0;
  std::string heaviest;
  double most = 0;
  for (const MacroTarget& target : macro_targets(macros)) {
    const std::filesystem::path path = files.macros / (target.name + ".target");
    if (!std::filesystem::exists(path)) {
      ++missing;
      const bool build = target.name.starts_with("universal-");
      const bool race = !build && target.name.find('/') == std::string::npos;
      builds += build ? target.weight : 0;
      races += race ? target.weight : 0;
      if (target.weight > most) {
        most = target.weight;
        heaviest = target.name;
      }
      continue;
    }
    const Blendshape shape = read_target(path, base.rows(), limits);
    for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
      base.row(shape.vertices[i]) += target.weight * shape.offsets.row(static_cast<Index>(i));
    }
  }
  if (missing == 0) {
    return;
  }
  char share[16];
  std::snprintf(share, sizeof share, "%.0f%%", 100 * std::max(builds, races));
  const std::string found = std::to_string(missing) + " of the targets of these sliders are not " +
                            "there, " + share + " of the body; the heaviest is " + heaviest +
                            ".target";
  const std::string advice = "the whole folder of targets, or other sliders";
  if (builds > kMaxMissing || races > kMaxMissing) {
    throw DataError(files.macros.string(), "macro targets", found, advice);
  }
  findings.push_back({Severity::Warning, "makehuman-macro", files.macros.string(), found,
                      "they are left out; take " + advice});
}

Eigen::RowVector3d mean(const Points& points, const std::vector<int>& rows) {
  Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
  for (const int row : rows) {
    sum += points.row(row);
  }
  return sum / static_cast<double>(rows.size());
}

Skeleton skeleton_of(const Rig& rig, const Points& base) {
  Skeleton skeleton;
  skeleton.offsets.resize(static_cast<Index>(rig.size()), 3);
  for (std::size_t b = 0; b < rig.size(); ++b) {
    skeleton.names.push_back(rig[b].name);
    skeleton.parents.push_back(rig[b].parent);
    Eigen::RowVector3d offset = mean(base, rig[b].head_vertices);
    if (rig[b].parent >= 0) {
      offset -= mean(base, rig[static_cast<std::size_t>(rig[b].parent)].head_vertices);
    }
    skeleton.offsets.row(static_cast<Index>(b)) = offset;
  }
  return skeleton;
}

// A target of the base mesh as a shape parameter of the body.
ShapeParameter parameter_of(const std::filesystem::path& path, const std::vector<int>& vertices,
                            const Rig& rig, Index base_vertices, const Limits& limits) {
  const Blendshape shape = read_target(path, base_vertices, limits);
  Points moved = Points::Zero(base_vertices, 3);
  for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
    moved.row(shape.vertices[i]) = shape.offsets.row(static_cast<Index>(i));
  }
  ShapeParameter parameter;
  parameter.name = path.stem().string();
  parameter.min = 0;
  parameter.max = 1;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (!moved.row(vertices[v]).isZero(0)) {
      parameter.surface.vertices.push_back(static_cast<int>(v));
    }
  }
  if (parameter.surface.vertices.empty()) {
    // No list means every vertex; one vertex that stays says that none moves.
    parameter.surface.vertices.push_back(0);
  }
  parameter.surface.offsets.resize(static_cast<Index>(parameter.surface.vertices.size()), 3);
  for (std::size_t i = 0; i < parameter.surface.vertices.size(); ++i) {
    parameter.surface.offsets.row(static_cast<Index>(i)) =
        moved.row(vertices[static_cast<std::size_t>(parameter.surface.vertices[i])]);
  }
  parameter.joints.resize(static_cast<Index>(rig.size()), 3);
  for (std::size_t b = 0; b < rig.size(); ++b) {
    parameter.joints.row(static_cast<Index>(b)) = mean(moved, rig[b].head_vertices);
  }
  return parameter;
}

}  // namespace

MakeHumanBody read_makehuman(const MakeHumanFiles& files, const MakeHumanOptions& options,
                             const Limits& limits) {
  const std::string base_name = files.base.string();
  const PolygonMesh polygons = read_obj(files.base, limits);
  const VertexGroups groups = vertex_groups(polygons);
  MakeHumanBody body;
  body.base_vertices = body_vertices(groups, base_name);
  body.base = kMetresPerMakeHumanUnit * polygons.vertices;
  const Index base_count = body.base.rows();
  apply_macros(files, options.macros, body.base, body.findings, limits);
  double floor = body.base(body.base_vertices[0], 1);
  for (const int vertex : body.base_vertices) {
    floor = std::min(floor, body.base(vertex, 1));
  }
  body.base.col(1).array() -= floor;

  const Rig rig = read_rig(files.rig, groups, base_count, limits);
  std::vector<std::vector<Influence>> influences =
      read_rig_weights(files.weights, rig, base_count, limits);
  std::vector<bool> is_body(static_cast<std::size_t>(base_count), false);
  for (const int vertex : body.base_vertices) {
    is_body[static_cast<std::size_t>(vertex)] = true;
  }
  for (std::size_t v = 0; v < influences.size(); ++v) {
    if (influences[v].empty() && !is_body[v]) {
      influences[v].push_back({0, 1});  // joint cubes and the like: nothing shows them
    }
  }
  SkinPackOptions pack;
  pack.max_slots = options.max_slots;
  const Index joints = static_cast<Index>(rig.size());
  body.base_skin = pack_skin_weights(influences, joints, pack, files.weights.string()).skin;
  // Findings are of the body alone; helper geometry has weights of all kinds.
  std::vector<std::vector<Influence>> body_influences;
  for (const int vertex : body.base_vertices) {
    body_influences.push_back(influences[static_cast<std::size_t>(vertex)]);
  }
  PackedSkin packed = pack_skin_weights(body_influences, joints, pack, files.weights.string());
  for (Finding& finding : packed.findings) {
    if (finding.code == "skin-weights-sum") {
      finding.severity = Severity::Note;  // so are MakeHuman's own files
    }
  }
  body.findings.insert(body.findings.end(), packed.findings.begin(), packed.findings.end());

  BodyModel& model = body.model;
  model.name = "makehuman";
  model.skeleton = skeleton_of(rig, body.base);
  model.mesh = body_mesh(polygons, body.base_vertices, body.base);
  model.skin = std::move(packed.skin);
  for (const std::filesystem::path& path : files.targets) {
    model.shape.push_back(parameter_of(path, body.base_vertices, rig, base_count, limits));
  }
  check_body_model(model, base_name);
  return body;
}

}  // namespace atelier
