#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "core/exit_code.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/io/mesh_gltf.h"
#include "core/printable.h"
#include "core/store/keep_rights.h"
#include "core/usage_error.h"
#include "core/writable_place.h"

namespace atelier {
namespace {

struct ConvertArguments {
  std::string in;
  std::string out;
};

struct ConvertOptions {
  MeshConvention input{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
};

OptionTable describe(ConvertOptions& options) {
  return OptionTable().add("input", describe(options.input));
}

void add_count(std::string& all, std::size_t count, const std::string& what) {
  if (count > 0) {
    all += (all.empty() ? "" : ", ") + counted(static_cast<std::int64_t>(count), what);
  }
}

/// Parts of a glTF scene that a mesh in its rest pose does not hold: "1 skin of 24 joints,
/// 2 animations"; "" if there are none.
std::string moving_parts(const GltfScene& scene) {
  std::size_t joints = 0;
  for (const GltfSkin& skin : scene.skins) {
    joints += skin.joints.size();
  }
  std::size_t shapes = 0;
  for (const GltfMesh& mesh : scene.meshes) {
    shapes += mesh.primitives.empty() ? 0 : mesh.primitives.front().targets.size();
  }
  std::string all;
  add_count(all, scene.skins.size(), "skin");
  if (joints > 0) {
    all += " of " + counted(static_cast<std::int64_t>(joints), "joint");
  }
  add_count(all, scene.animations.size(), "animation");
  add_count(all, shapes, "blend shape");
  return all;
}

/// Attributes of a mesh that a format has no place for.
std::string attributes_without_place(const Mesh& mesh, const std::string& extension) {
  std::string all;
  if (extension != ".ply" && !mesh.labels.empty()) {
    all = "labels";
  }
  if (extension != ".ply" && mesh.confidence.size() > 0) {
    all += (all.empty() ? "" : ", ") + std::string("confidence");
  }
  return all;
}

bool is_said(const OptionTable& table, const std::string& name) {
  return std::any_of(table.fields.begin(), table.fields.end(), [&](const OptionField& field) {
    return field.name == name && field.source != "default";
  });
}

/// Refuses options for files that do not state something beside a file that does: they would do
/// nothing.
void require_use(const OptionTable& table, const MeshConvention& said) {
  if (said.metres_per_unit > 0 && is_said(table, "input.unit")) {
    throw UsageError("--input.unit does nothing: IN says its unit; leave it out");
  }
  if (said.up != '\0' && is_said(table, "input.up")) {
    throw UsageError("--input.up does nothing: IN says which axis is up; leave it out");
  }
}

int run(const ConvertArguments& arguments, const OptionSet& set) {
  const auto& options = options_of<ConvertOptions>(set);
  if (arguments.in.empty() || arguments.out.empty()) {
    throw UsageError("convert takes two files: atelier convert IN OUT");
  }
  const std::string extension = lower_extension(arguments.out);
  if (extension != ".obj" && extension != ".ply" && extension != ".glb") {
    throw UsageError("OUT cannot be '" + arguments.out.substr(0, 80) +
                     "': it takes a name with .obj, .ply or .glb");
  }
  std::error_code none;  // where one of them is missing they are not the same
  if (std::filesystem::equivalent(arguments.in, arguments.out, none)) {
    throw UsageError("OUT cannot be '" + arguments.out.substr(0, 80) +
                     "': it is IN itself, which would be lost; name another file");
  }
  require_file_place(arguments.out);
  const std::string from = lower_extension(arguments.in);
  std::string left_out;
  MeshFile file;
  const Mesh& mesh = file.mesh;
  if (from == ".glb" || from == ".gltf") {
    const GltfScene scene = read_gltf(arguments.in);
    file = mesh_of_scene(scene, arguments.in);
    left_out = moving_parts(scene);
  } else {
    file = read_mesh_file(arguments.in, options.input);
  }
  require_use(set.table, file.said);
  if (extension == ".glb") {
    GltfScene scene = gltf_scene(mesh);
    keep_rights({arguments.in}, scene);
    write_gltf(arguments.out, scene);
  } else {
    write_mesh(arguments.out, mesh);
  }
  std::cout << printable(arguments.out) << ": " << mesh.vertices.rows() << " vertices, "
            << mesh.faces.rows() << " faces, metres, Y up\n";
  for (const Finding& finding : file.findings) {
    std::cout << "  " << printable(to_string(finding)) << "\n";
  }
  if (const auto finding = unit_finding(file, arguments.in)) {
    std::cout << "  " << printable(to_string(*finding)) << "\n";
  } else if (!(file.said.metres_per_unit > 0) && !is_said(set.table, "input.unit")) {
    std::cout << "  IN does not say its unit: --input.unit counts, metres unless it is given\n";
  }
  if (!left_out.empty()) {
    std::cout << "  left out, since OUT is a mesh at rest: " << left_out
              << "; body-model convert keeps a body's\n";
  }
  if (const std::string lost = attributes_without_place(mesh, extension); !lost.empty()) {
    std::cout << "  left out, since " << extension << " has no place for it: " << lost
              << "; .ply has\n";
  }
  return kExitDone;
}

}  // namespace

OptionSet convert_options() {
  return option_set<ConvertOptions>();
}

Action add_convert(CLI::App& parser) {
  auto arguments = std::make_shared<ConvertArguments>();
  add_option(parser, "IN", arguments->in, "Mesh to read: .obj, .ply, .glb, .gltf, .fbx").required();
  add_option(parser, "OUT", arguments->out, "Mesh to write: .obj, .ply, .glb; metres, Y up")
      .required();
  const OptionReader options = add_option_flags(parser, convert_options());
  return [arguments, options] { return run(*arguments, options()); };
}

}  // namespace atelier
