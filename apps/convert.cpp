#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/option_flags.h"
#include "apps/output_place.h"
#include "apps/usage_error.h"
#include "core/io/mesh_file.h"

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

int run(const ConvertArguments& arguments, const ConvertOptions& options) {
  if (arguments.in.empty() || arguments.out.empty()) {
    throw UsageError("convert takes two files: atelier convert IN OUT");
  }
  std::string extension = std::filesystem::path(arguments.out).extension().string();
  for (char& c : extension) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
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
  const Mesh mesh = read_mesh(arguments.in, options.input);
  write_mesh(arguments.out, mesh);
  std::cout << arguments.out << ": " << mesh.vertices.rows() << " vertices, " << mesh.faces.rows()
            << " faces, metres, Y up\n";
  return kExitDone;
}

}  // namespace

OptionSet convert_options() {
  return option_set<ConvertOptions>();
}

Action add_convert(CLI::App& parser) {
  auto arguments = std::make_shared<ConvertArguments>();
  parser.add_option("IN", arguments->in, "Mesh to read: .obj, .ply, .glb, .gltf, .fbx")->required();
  parser.add_option("OUT", arguments->out, "Mesh to write: .obj, .ply, .glb; metres, Y up")
      ->required();
  const OptionReader options = add_option_flags(parser, convert_options());
  return [arguments, options] { return run(*arguments, options_of<ConvertOptions>(options())); };
}

}  // namespace atelier
