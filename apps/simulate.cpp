#if defined(ATELIER_HAS_CORE_RENDER) && defined(ATELIER_HAS_SIMULATION)

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/option_flags.h"
#include "apps/usage_error.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/sequence_folder.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "simulation/xpbd.h"

namespace atelier {
namespace {

struct SimulateArguments {
  std::string garment;
  std::string body;
  std::string out;
};

struct SimulateOptions {
  Device device = Device::Cpu;
  double fps = 60;     ///< of the body; sets the solver's time_step
  int settle = 60;     ///< frames on the first body before it moves
  double pin_top = 0;  ///< metres below the garment's highest vertex that ride on the body
  bool grid = false;   ///< instead: one picture over bending and stretching stiffness
  Material material;
  XpbdOptions xpbd;
};

OptionTable describe(SimulateOptions& options) {
  OptionTable table;
  table.add("device", options.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Where the cloth moves");
  table.add("fps", options.fps, 1, 10000, "1/s", "Frames per second of the body");
  table.add("settle", options.settle, 0, 1000000, "", "Frames on the first body before it moves");
  table.add("pin_top", options.pin_top, 0, 1, "m",
            "How far below its top the garment rides on the body");
  table.add("grid", options.grid, "Instead: grid.png over bending and stretching stiffness");
  table.add("material", describe(options.material));
  OptionTable xpbd = describe(options.xpbd);
  std::erase_if(xpbd.fields, [](const OptionField& field) { return field.name == "time_step"; });
  return table.add("xpbd", xpbd);
}

/// Vertices near the top ride on the body's nearest triangle, as a waistband or collar does.
void attach_top(Garment& garment, const Mesh& body, double depth) {
  const double top = garment.mesh.vertices.col(1).maxCoeff();
  for (Index v = 0; depth > 0 && v < garment.mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d p = garment.mesh.vertices.row(v).transpose();
    if (p.y() < top - depth) {
      continue;
    }
    Attachment attachment{static_cast<int>(v), 0, {1, 0, 0}, 0};
    double best = std::numeric_limits<double>::infinity();
    for (Index f = 0; f < body.faces.rows(); ++f) {
      const double d = (body.vertices.row(body.faces(f, 0)).transpose() - p).squaredNorm();
      if (d < best) {
        best = d;
        attachment.triangle = static_cast<int>(f);
        attachment.distance = std::sqrt(d);
      }
    }
    garment.attachments.push_back(attachment);
  }
}

std::string frame_path(const std::string& folder, std::int64_t frame) {
  char name[32];
  std::snprintf(name, sizeof(name), "frame-%06lld.ply", static_cast<long long>(frame));
  return (std::filesystem::path(folder) / name).string();
}

Image picture(const Cloth& cloth, const ClothState& state, const Mesh* body) {
  Mesh garment;
  garment.vertices = state.positions;
  garment.faces = cloth.faces;
  std::vector<RenderMesh> meshes;
  RenderMesh dressed;
  dressed.mesh = garment;
  dressed.look = clay_look();
  meshes.push_back(dressed);
  if (body != nullptr) {
    RenderMesh wearer;
    wearer.mesh = *body;
    wearer.look = clay_look();
    meshes.push_back(wearer);
  }
  PictureOptions options;
  options.width = 300;
  options.height = 400;
  return picture_of(meshes, kThreeQuarter, options);
}

/// The grid of the paper's Fig. 1: stretch stiffness over columns, bending over rows.
int run_grid(const std::filesystem::path& out, const SimulateOptions& options, const Cloth& cloth,
             const Mesh& body) {
  const std::vector<double> factors{0.1, 1, 10};
  std::vector<ClothVariation> variations;
  for (double bending : factors) {
    for (double stretch : factors) {
      variations.push_back({stretch, bending, -1});
    }
  }
  ClothSweep sweep(cloth, variations, body.faces, options.xpbd, options.device);
  Control control;
  control.body_start = body.vertices;
  control.body_end = body.vertices;
  for (int frame = 0; frame < options.settle; ++frame) {
    sweep.advance(control);
  }
  std::vector<CaptionedImage> pictures;
  for (int scene = 0; scene < sweep.scene_count(); ++scene) {
    const ClothVariation& v = variations[static_cast<std::size_t>(scene)];
    char caption[64];
    std::snprintf(caption, sizeof(caption), "stretch x%g  bend x%g", v.stretch, v.bending);
    pictures.push_back(
        {picture(cloth, sweep.state(scene), body.vertices.rows() > 0 ? &body : nullptr), caption});
  }
  ContactSheetOptions sheet;
  sheet.columns = static_cast<int>(factors.size());
  write_image(out / "grid.png", contact_sheet(pictures, sheet));
  std::cout << (out / "grid.png").string() << "\n";
  return kExitDone;
}

int run(const SimulateArguments& arguments, SimulateOptions options) {
  if (arguments.garment.empty() || arguments.out.empty()) {
    throw UsageError(
        "it takes a garment and a folder: atelier simulate --garment MESH --out FOLDER");
  }
  Garment garment;
  garment.name = arguments.garment;
  garment.mesh = read_mesh(arguments.garment);
  garment.material = options.material;
  Sequence bodies;
  Mesh body;
  if (!arguments.body.empty()) {
    bodies = read_sequence_folder(arguments.body);
    body = frame(bodies, 0);
    attach_top(garment, body, options.pin_top);
  }
  options.xpbd.time_step = 1 / options.fps;
  const Cloth cloth = make_cloth(garment);
  make_private_directory(arguments.out);
  if (options.grid) {
    return run_grid(arguments.out, options, cloth, body);
  }
  ClothSolver solver(cloth, body.faces, options.xpbd, options.device);
  const Index moving = body.vertices.rows() > 0 ? frame_count(bodies) - 1 : 0;
  const Index total = options.settle + moving;
  std::vector<CaptionedImage> pictures;
  for (Index i = 0; i < total; ++i) {
    Control control;
    if (body.vertices.rows() > 0) {
      control.body_start = body.vertices;
      if (i >= options.settle) {
        body = frame(bodies, i - options.settle + 1);
      }
      control.body_end = body.vertices;
    }
    const FrameReport report = solver.advance(control);
    const ClothState state = solver.state();
    Mesh out;
    out.vertices = state.positions;
    out.faces = cloth.faces;
    write_mesh(frame_path(arguments.out, report.frame), out);
    char line[200];
    std::snprintf(line, sizeof(line),
                  "frame %lld: strain p50 %.2f%% p95 %.2f%% max %.2f%%, %d inside the body (%.2f "
                  "mm), %d touching",
                  static_cast<long long>(report.frame), 100 * report.strain_p50,
                  100 * report.strain_p95, 100 * report.strain_max, report.penetrating,
                  1e3 * report.penetration_depth, report.body_contacts);
    std::cout << line << '\n';
    if (i % std::max<Index>(1, total / 8) == 0 || i + 1 == total) {
      pictures.push_back({picture(cloth, state, body.vertices.rows() > 0 ? &body : nullptr),
                          "frame " + std::to_string(report.frame)});
    }
  }
  write_image(std::filesystem::path(arguments.out) / "sheet.png", contact_sheet(pictures));
  std::cout << arguments.out << "/sheet.png\n";
  return kExitDone;
}

}  // namespace

OptionSet simulate_options() {
  return option_set<SimulateOptions>();
}

Action add_simulate(CLI::App& parser) {
  auto a = std::make_shared<SimulateArguments>();
  parser.add_option("--garment", a->garment, "Mesh of the garment, in metres")->type_name("MESH");
  parser.add_option("--body", a->body, "Mesh of the body, or a folder of meshes, one a frame")
      ->type_name("MESH|FOLDER");
  parser.add_option("--out", a->out, "Folder for one .ply a frame and sheet.png")
      ->type_name("FOLDER");
  const OptionReader options = add_option_flags(parser, simulate_options());
  return [a, options] { return run(*a, options_of<SimulateOptions>(options())); };
}

}  // namespace atelier

#endif
