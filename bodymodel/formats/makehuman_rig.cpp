#include "bodymodel/formats/makehuman_rig.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/io/json.h"

namespace atelier {
namespace {

using nlohmann::json;

const json& field(const json& object, const char* name, const std::string& file,
                  const std::string& where) {
  if (!object.is_object() || !object.contains(name)) {
    throw DataError(file, where, "no field '" + std::string(name) + "'", "that field");
  }
  return object[name];
}

int vertex_of(const json& value, Index base_vertices, const std::string& file,
              const std::string& where) {
  if (!value.is_number_integer() || value < 0 || value >= base_vertices) {
    throw DataError(file, where, "vertex " + value.dump(),
                    "a vertex in [0, " + std::to_string(base_vertices) + ")");
  }
  return value.get<int>();
}

std::vector<int> vertices_of(const json& list, Index base_vertices, const std::string& file,
                             const std::string& where) {
  if (!list.is_array() || list.empty()) {
    throw DataError(file, where, "no list of vertices", "one vertex or more");
  }
  std::vector<int> vertices;
  for (const json& value : list) {
    vertices.push_back(vertex_of(value, base_vertices, file, where));
  }
  return vertices;
}

std::string text_of(const json& value, const std::string& file, const std::string& where) {
  if (!value.is_string()) {
    throw DataError(file, where, "no text", "text");
  }
  return value.get<std::string>();
}

// One end of a bone in an MPFB2 rig.
std::vector<int> mpfb_end(const json& end, const VertexGroups& groups, Index base_vertices,
                          const std::string& file, const std::string& where) {
  const std::string strategy = text_of(field(end, "strategy", file, where), file, where);
  if (strategy == "CUBE") {
    const std::string cube = text_of(field(end, "cube_name", file, where), file, where);
    for (const VertexGroup& group : groups) {
      if (group.name == cube) {
        return group.vertices;
      }
    }
    throw DataError(file, where, "cube '" + cube + "'", "a group of the base mesh");
  }
  if (strategy == "VERTEX") {
    return {vertex_of(field(end, "vertex_index", file, where), base_vertices, file, where)};
  }
  if (strategy == "MEAN") {
    return vertices_of(field(end, "vertex_indices", file, where), base_vertices, file, where);
  }
  throw DataError(file, where, "strategy '" + strategy + "'", "CUBE, VERTEX or MEAN");
}

struct NamedBone {
  RigBone bone;
  std::string parent;
};

NamedBone read_bone(const std::string& name, const json& value, const json* joints,
                    const VertexGroups& groups, Index base_vertices, const std::string& file) {
  const std::string where = "bone " + name;
  NamedBone result;
  result.bone.name = name;
  const json& parent = field(value, "parent", file, where);
  result.parent = parent.is_null() ? "" : text_of(parent, file, where);
  for (const char* end : {"head", "tail"}) {
    const json& place = field(value, end, file, where);
    std::vector<int>& vertices =
        end[0] == 'h' ? result.bone.head_vertices : result.bone.tail_vertices;
    if (joints != nullptr) {
      const std::string joint = text_of(place, file, where);
      vertices = vertices_of(field(*joints, joint.c_str(), file, where), base_vertices, file,
                             "joint " + joint);
    } else {
      vertices = mpfb_end(place, groups, base_vertices, file, where);
    }
  }
  return result;
}

// Parents before children; the file's order among brothers.
Rig sorted(const std::vector<NamedBone>& bones, const std::string& file) {
  std::map<std::string, std::vector<std::size_t>> children;
  std::map<std::string, std::size_t> by_name;
  for (std::size_t i = 0; i < bones.size(); ++i) {
    by_name[bones[i].bone.name] = i;
  }
  std::vector<std::size_t> roots;
  for (std::size_t i = 0; i < bones.size(); ++i) {
    if (bones[i].parent.empty()) {
      roots.push_back(i);
    } else if (!by_name.contains(bones[i].parent)) {
      throw DataError(file, "bone " + bones[i].bone.name, "parent '" + bones[i].parent + "'",
                      "a bone of the rig");
    } else {
      children[bones[i].parent].push_back(i);
    }
  }
  if (roots.size() > 1) {
    throw DataError(file, "rig",
                    "two roots, " + bones[roots[0]].bone.name + " and " + bones[roots[1]].bone.name,
                    "one bone without a parent");
  }
  Rig rig;
  std::vector<std::pair<std::size_t, int>> open;  // bone, index of its parent
  if (!roots.empty()) {
    open.push_back({roots[0], -1});
  }
  while (!open.empty()) {
    const auto [i, parent] = open.back();
    open.pop_back();
    const int index = static_cast<int>(rig.size());
    rig.push_back(bones[i].bone);
    rig.back().parent = parent;
    const std::vector<std::size_t>& below = children[bones[i].bone.name];
    for (auto child = below.rbegin(); child != below.rend(); ++child) {
      open.push_back({*child, index});
    }
  }
  if (rig.size() != bones.size()) {
    throw DataError(
        file, "rig",
        std::to_string(bones.size() - rig.size()) + " bones that do not hang on the root",
        "a tree (there is a cycle of parents)");
  }
  return rig;
}

}  // namespace

Rig parse_rig(const json& value, const VertexGroups& groups, Index base_vertices,
              const std::string& file, const Limits& limits) {
  if (!value.is_object()) {
    throw DataError(file, "rig", "no JSON object", "bones");
  }
  // MakeHuman: bones and joints; MPFB2: bones, or the bones at the top level.
  const json* bones = value.contains("bones") ? &value["bones"] : &value;
  const json* joints = value.contains("joints") ? &value["joints"] : nullptr;
  if (!bones->is_object() || bones->empty()) {
    throw DataError(file, "rig", "no bones", "one bone or more");
  }
  if (static_cast<std::int64_t>(bones->size()) > limits.joints) {
    throw DataError(file, "rig", std::to_string(bones->size()) + " bones",
                    "at most " + std::to_string(limits.joints));
  }
  std::vector<NamedBone> named;
  for (const auto& [name, bone] : bones->items()) {
    named.push_back(read_bone(name, bone, joints, groups, base_vertices, file));
  }
  return sorted(named, file);
}

Rig read_rig(const std::filesystem::path& path, const VertexGroups& groups, Index base_vertices,
             const Limits& limits) {
  return parse_rig(read_json(path, limits), groups, base_vertices, path.string(), limits);
}

std::vector<std::vector<Influence>> parse_rig_weights(const json& value, const Rig& rig,
                                                      Index base_vertices,
                                                      const std::string& file) {
  const json& bones = field(value, "weights", file, "weights");
  if (!bones.is_object()) {
    throw DataError(file, "weights", "no JSON object", "lists of vertices and weights by bone");
  }
  std::map<std::string, int> by_name;
  for (std::size_t b = 0; b < rig.size(); ++b) {
    by_name[rig[b].name] = static_cast<int>(b);
  }
  std::vector<std::vector<Influence>> influences(static_cast<std::size_t>(base_vertices));
  for (const auto& [name, list] : bones.items()) {
    const std::string where = "weights of bone " + name;
    const auto bone = by_name.find(name);
    if (bone == by_name.end()) {
      throw DataError(file, where, "a bone that the rig does not have", "weights of this rig");
    }
    if (!list.is_array()) {
      throw DataError(file, where, "no list", "[vertex, weight] pairs");
    }
    for (const json& pair : list) {
      if (!pair.is_array() || pair.size() != 2 || !pair[1].is_number()) {
        throw DataError(file, where, "an entry that is no pair of numbers", "[vertex, weight]");
      }
      const int vertex = vertex_of(pair[0], base_vertices, file, where);
      influences[static_cast<std::size_t>(vertex)].push_back({bone->second, pair[1].get<double>()});
    }
  }
  return influences;
}

std::vector<std::vector<Influence>> read_rig_weights(const std::filesystem::path& path,
                                                     const Rig& rig, Index base_vertices,
                                                     const Limits& limits) {
  return parse_rig_weights(read_json(path, limits), rig, base_vertices, path.string());
}

}  // namespace atelier
