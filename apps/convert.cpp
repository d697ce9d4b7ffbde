#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/usage_error.h"
#include "core/error.h"
#include "core/io/mesh_file.h"
#include "core/store/file_kind.h"

namespace atelier {
namespace {

struct ConvertArguments {
  std::string in;
  std::string out;
  std::string unit = "m";
  std::string up = "y";
};

int run(const ConvertArguments& arguments) {
  if (arguments.in.empty() || arguments.out.empty()) {
    throw UsageError("it takes two files: atelier convert IN OUT");
  }
  std::string extension = std::filesystem::path(arguments.out).extension().string();
  for (char& c : extension) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  if (extension != ".obj" && extension != ".ply" && extension != ".glb") {
    throw UsageError("OUT cannot be '" + arguments.out.substr(0, 80) +
                     "': it takes a name with .obj, .ply or .glb");
  }
  if (file_kind(arguments.in) == std::filesystem::file_type::directory) {
    throw DataError(arguments.in, "", "a folder", "a mesh file: .obj, .ply, .glb or .gltf");
  }
  const Mesh mesh = read_mesh(
      arguments.in, {.metres_per_unit = metres_of_unit(arguments.unit), .up = arguments.up[0]});
  write_mesh(arguments.out, mesh);
  std::cout << arguments.out << ": " << mesh.vertices.rows() << " vertices, " << mesh.faces.rows()
            << " faces, metres, Y up\n";
  return kExitDone;
}

}  // namespace

Action add_convert(CLI::App& parser) {
  auto arguments = std::make_shared<ConvertArguments>();
  parser.add_option("IN", arguments->in, "Mesh to read: .obj, .ply, .glb, .gltf")->required();
  parser.add_option("OUT", arguments->out, "Mesh to write: .obj, .ply, .glb; metres, Y up")
      ->required();
  parser.add_option("--unit", arguments->unit, "Unit of IN if it does not say [m]")
      ->check(CLI::IsMember({"m", "dm", "cm", "mm", "in", "ft"}))
      ->type_name("m|dm|cm|mm|in|ft");
  parser.add_option("--up", arguments->up, "Up axis of IN if it does not say [y]")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->type_name("x|y|z");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier
