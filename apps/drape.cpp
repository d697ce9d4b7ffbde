#if defined(ATELIER_HAS_BODYMODEL) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_CORE_RENDER)

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
#include "apps/option_flags.h"
#include "apps/output_place.h"
#include "apps/tailor.h"
#include "apps/usage_error.h"
#include "bodymodel/default_human.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "registration/pattern_garment.h"
#include "simulation/weld_seams.h"
#include "simulation/xpbd.h"

namespace atelier {
namespace {

// What a seamstress does: the seams are closed slowly and with little weight, then the cloth hangs.
constexpr int kSewingFrames = 60;
constexpr int kFramesPerStitch = 2;   // the threads are shortened evenly, this often
constexpr double kSewingGravity = 2;  // m/s2, keeps a skirt down while its sides are drawn together
constexpr double kSewingDamping = 15;  // 1/s, so that sewing springs do not throw the cloth about
constexpr double kHangingDamping = 2;  // 1/s, to come to rest sooner

struct DrapeOptions {
  std::string garment = "dress";
  std::string body = "female";
  int frames = 150;   ///< 60 a second
  bool video = true;  ///< a turntable, which takes as long as the rest
  Device device = Device::Cpu;
  PatternGarmentOptions pattern;
};

OptionTable describe(DrapeOptions& options) {
  OptionTable table;
  table.add("garment", options.garment, {"tee", "skirt", "dress", "trousers"},
            "Pattern, drafted to the body's measures");
  table.add("body", options.body, {"female", "male"}, "Default human");
  table.add("frames", options.frames, kSewingFrames + 1, 10000, "",
            "60 a second; the first " + std::to_string(kSewingFrames) + " sew");
  table.add("video", options.video, "A turntable beside the pictures");
  table.add("device", options.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Where the cloth moves");
  table.add("pattern", describe(options.pattern));
  return table;
}

SewingPattern pattern_of(const std::string& name, const TailorMeasures& measures) {
  if (name == "tee") {
    return tee_pattern(measures);
  }
  if (name == "skirt") {
    return skirt_pattern(measures);
  }
  return name == "dress" ? dress_pattern(measures) : trousers_pattern(measures);
}

struct Draped {
  std::vector<Mesh> frames;  ///< sewing in panels, then hanging as one piece
  int sewing_frames = 0;
  FrameReport last;
};

Draped sew_and_drape(const Garment& panels, const Mesh& body, int frames, Device device) {
  Control control;
  control.body_start = control.body_end = body.vertices;
  XpbdOptions options;
  options.thickness = 0.005;  // more than a triangle of 2 cm sinks into the round of a chest
  Draped draped;
  const auto run = [&](const Cloth& cloth, ClothState state, int count) {
    ClothSolver solver(cloth, body.faces, options, device);
    solver.set_state(state);
    for (int i = 0; i < count; ++i) {
      draped.last = solver.advance(control);
      Mesh mesh = panels.mesh;
      mesh.faces = cloth.faces;
      mesh.vertices = solver.state().positions;
      draped.frames.push_back(std::move(mesh));
    }
    return solver.state();
  };

  Cloth cloth = make_cloth(panels);
  ClothState state = rest_state(cloth);
  std::vector<double> gaps;
  const auto sewing_begin = static_cast<std::size_t>(cloth.sewing_begin);
  for (std::size_t i = sewing_begin; i < cloth.springs.size(); ++i) {
    const ClothSpring& thread = cloth.springs[i];
    gaps.push_back((state.positions.row(thread.a) - state.positions.row(thread.b)).norm());
  }
  options.velocity_damping = kSewingDamping;
  control.gravity = {0, -kSewingGravity, 0};
  const int steps = std::min(kSewingFrames, frames) / kFramesPerStitch;
  for (int step = 1; step <= steps; ++step) {
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      cloth.springs[sewing_begin + i].rest = gaps[i] * (steps - step) / steps;
    }
    state = run(cloth, state, kFramesPerStitch);
  }

  Garment sewn = panels;
  sewn.mesh.vertices = state.positions;
  sewn = weld_seams(sewn);
  draped.sewing_frames = static_cast<int>(draped.frames.size());
  options.velocity_damping = kHangingDamping;
  options.self_contact = true;
  control.gravity = {0, -9.81, 0};
  cloth = make_cloth(sewn);
  run(cloth, rest_state(cloth), frames - draped.sewing_frames);
  return draped;
}

int run(const std::filesystem::path& out, const DrapeOptions& options) {
  if (out.empty()) {
    throw UsageError("it takes a folder: atelier drape --garment dress --out FOLDER");
  }
  if (std::filesystem::exists(out)) {
    throw UsageError("--out cannot be '" + out.string() +
                     "': it is there already; name a new folder");
  }
  require_folder_place(out);
  const BodyModel human = default_human(options.body == "male" ? male_human() : female_human());
  const SewingPattern pattern = pattern_of(options.garment, tailor_measures(human));
  const Garment garment = garment_from_pattern(pattern, options.pattern);
  std::cout << pattern.name << ": " << pattern.panels.size() << " panels, " << pattern.seams.size()
            << " seams, " << garment.mesh.faces.rows() << " triangles\n";

  const Draped draped = sew_and_drape(garment, human.mesh, options.frames, options.device);
  std::cout << "draped: strain p50 " << draped.last.strain_p50 << ", p95 " << draped.last.strain_p95
            << "; " << draped.last.penetrating << " vertices inside the body, "
            << 1000 * draped.last.penetration_depth << " mm at most\n";

  const auto hanging = draped.frames.begin() + draped.sewing_frames;
  write_sequence(out / "garment", sequence_of({hanging, draped.frames.end()}, 60));
  write_mesh(out / "body.obj", human.mesh);
  write_mesh(out / "garment.obj", draped.frames.back());

  Look cloth = clay_look();
  cloth.color = {0.16f, 0.24f, 0.42f};
  PictureOptions picture;
  picture.width = 400;
  picture.height = 600;
  const auto dressed = [&](std::size_t frame) {
    return std::vector<RenderMesh>{{human.mesh, clay_look()}, {draped.frames[frame], cloth}};
  };
  const std::size_t last = draped.frames.size() - 1;
  std::vector<CaptionedImage> cells;
  for (const std::size_t frame : {std::size_t{0}, last / 5, last * 2 / 5, last}) {
    cells.push_back(
        {picture_of(dressed(frame), kThreeQuarter, picture), "frame " + std::to_string(frame)});
  }
  cells.push_back({picture_of(dressed(last), kFront, picture), "front"});
  cells.push_back({picture_of(dressed(last), kSide, picture), "side"});
  cells.push_back({picture_of(dressed(last), kBack, picture), "back"});
  write_image(
      out / "drape.png",
      contact_sheet(cells, {.columns = 4, .title = "A " + pattern.name + ", sewn and draped"}));
  if (options.video) {
    constexpr int kTurn = 36;
    const std::vector<Image> turn = turntable_of(dressed(last), kTurn, kFront, picture);
    write_video(out / "turntable.mp4", kTurn,
                [&](Index i) { return turn[static_cast<std::size_t>(i)]; }, {.fps = 12});
  }
  std::cout << (out / "drape.png").string() << "\n";
  return kExitDone;
}

}  // namespace

OptionSet drape_options() {
  return option_set<DrapeOptions>();
}

Action add_drape(CLI::App& parser) {
  const auto out = std::make_shared<std::string>();
  parser.add_option("--out", *out, "New folder: sequence, meshes, pictures, video")
      ->type_name("FOLDER");
  const OptionReader options = add_option_flags(parser, drape_options());
  return [out, options] { return run(*out, options_of<DrapeOptions>(options())); };
}

}  // namespace atelier

#endif
