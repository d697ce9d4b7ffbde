#include <iostream>
#include <memory>
#include <numbers>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/printable.h"
#include "core/render/studio.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/pictures/picture_names.h"
#include "pipeline/pictures/picture_size.h"

namespace atelier {
namespace {

struct RenderArguments {
  std::string mesh;
  std::string out;
};

struct RenderCommandOptions {
  double azimuth = 34;   ///< degrees; as kThreeQuarter
  double elevation = 9;  ///< degrees
  PictureOptions picture;
  MeshConvention input{.metres_per_unit = 1, .up = 'y'};  ///< of files that do not say
};

OptionTable describe(RenderCommandOptions& options) {
  OptionTable table;
  table.add("azimuth", options.azimuth, -360, 360, "degrees",
            "Azimuth of the camera: 0 in front of the subject, 90 at its left");
  table.add("elevation", options.elevation, -90, 90, "degrees",
            "Elevation of the camera: 0 level, 90 above");
  table.add(describe(options.picture));
  table.add("input", describe(options.input));
  return table;
}

/// Refuses what was said of files that do not state it beside a file that does.
void require_input_use(const OptionTable& table, const MeshConvention& said) {
  for (const OptionField& field : table.fields) {
    if (field.source != "default" && ((field.name == "input.unit" && said.metres_per_unit > 0) ||
                                      (field.name == "input.up" && said.up != '\0'))) {
      throw UsageError("--" + field.name + " does nothing: MESH says " +
                       (field.name == "input.up" ? "which axis is up" : "its unit") +
                       "; leave it out");
    }
  }
}

int run(const RenderArguments& arguments, const OptionSet& set) {
  const auto& options = options_of<RenderCommandOptions>(set);
  if (arguments.mesh.empty() || arguments.out.empty()) {
    throw UsageError("render takes a MESH and --out: atelier render MESH --out image.png");
  }
  if (!image_format_of_name(arguments.out)) {
    throw UsageError("--out cannot be '" + arguments.out.substr(0, 80) +
                     "': it takes a name with " + kPictureNames);
  }
  require_picture_size(options.picture);
  require_file_place(arguments.out);
  const MeshFile file = read_mesh_file(arguments.mesh, options.input);
  require_input_use(set.table, file.said);
  const Mesh& mesh = file.mesh;
  if (mesh.faces.rows() == 0) {
    throw DataError(arguments.mesh, "", "no faces", "a triangle mesh");
  }
  const View view{options.azimuth * std::numbers::pi / 180,
                  options.elevation * std::numbers::pi / 180};
  write_image(arguments.out, picture_of(mesh, view, options.picture));
  std::cout << printable(arguments.out) << ": " << options.picture.width << " x "
            << options.picture.height << " pixels\n";
  if (const auto finding = unit_finding(file, arguments.mesh)) {
    std::cout << "  " << printable(to_string(*finding)) << "\n";
  }
  return kExitDone;
}

}  // namespace

OptionSet render_options() {
  return option_set<RenderCommandOptions>();
}

Action add_render(CLI::App& parser) {
  auto arguments = std::make_shared<RenderArguments>();
  add_option(parser, "MESH", arguments->mesh, "Mesh to show: .obj, .ply, .glb, .gltf, .fbx")
      .required();
  add_option(parser, "--out", arguments->out, "Image to write").type_name("IMAGE").required();
  add_flag(
      parser, "--neural", [] {},
      "Images of a clothed person by trained networks instead; atelier render --neural --help says "
      "more");
  const OptionReader options = add_option_flags(parser, render_options());
  return [arguments, options] { return run(*arguments, options()); };
}

}  // namespace atelier
