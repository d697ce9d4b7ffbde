#ifdef ATELIER_HAS_CORE_RENDER

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/usage_error.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/render/studio.h"

namespace atelier {
namespace {

struct RenderArguments {
  std::string mesh;
  std::string out;
  std::string unit = "m";
  std::string up = "y";
  double azimuth = kThreeQuarter.azimuth * 180 / std::numbers::pi;      ///< degrees
  double elevation = kThreeQuarter.elevation * 180 / std::numbers::pi;  ///< degrees
  PictureOptions picture;
};

int run(const RenderArguments& arguments) {
  if (arguments.mesh.empty() || arguments.out.empty()) {
    throw UsageError("it takes a mesh and a name: atelier render MESH --out PNG");
  }
  if (std::filesystem::path(arguments.out).extension() != ".png") {
    throw UsageError("--out cannot be '" + arguments.out.substr(0, 80) +
                     "': it takes a name with .png");
  }
  if (!std::isfinite(arguments.azimuth) || !std::isfinite(arguments.elevation)) {
    throw UsageError("--azimuth and --elevation take numbers of degrees");  // a range lets NaN by
  }
  const Mesh mesh = read_mesh(
      arguments.mesh, {.metres_per_unit = metres_of_unit(arguments.unit), .up = arguments.up[0]});
  const View view{arguments.azimuth * std::numbers::pi / 180,
                  arguments.elevation * std::numbers::pi / 180};
  write_image(arguments.out, picture_of(mesh, view, arguments.picture));
  std::cout << arguments.out << ": " << arguments.picture.width << " x " << arguments.picture.height
            << " pixels\n";
  return kExitDone;
}

}  // namespace

Action add_render(CLI::App& parser) {
  auto arguments = std::make_shared<RenderArguments>();
  parser.add_option("MESH", arguments->mesh, "Mesh to show: .obj, .ply, .glb, .gltf")->required();
  parser.add_option("--out", arguments->out, "Picture to write")->type_name("PNG")->required();
  parser.add_option("--azimuth", arguments->azimuth, "0 from the front, 90 from its left [34]")
      ->check(CLI::Range(-360.0, 360.0))
      ->type_name("DEGREES");
  parser.add_option("--elevation", arguments->elevation, "0 level, 90 from above [9]")
      ->check(CLI::Range(-90.0, 90.0))
      ->type_name("DEGREES");
  parser.add_option("--width", arguments->picture.width, "[600]")
      ->check(CLI::Range(16, 8192))
      ->type_name("PIXELS");
  parser.add_option("--height", arguments->picture.height, "[800]")
      ->check(CLI::Range(16, 8192))
      ->type_name("PIXELS");
  parser.add_option("--samples", arguments->picture.samples, "Per pixel; 32 for print [8]")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  parser.add_option("--unit", arguments->unit, "Unit of MESH if it does not say [m]")
      ->check(CLI::IsMember({"m", "dm", "cm", "mm", "in", "ft"}))
      ->type_name("m|dm|cm|mm|in|ft");
  parser.add_option("--up", arguments->up, "Up axis of MESH if it does not say [y]")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->type_name("x|y|z");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier

#endif
