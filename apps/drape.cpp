#if defined(ATELIER_HAS_BODYMODEL) && defined(ATELIER_HAS_REGISTRATION) && \
    defined(ATELIER_HAS_SIMULATION) && defined(ATELIER_HAS_CORE_RENDER)

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/command.h"
#include "apps/exit_code.h"
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

struct DrapeArguments {
  std::string garment = "dress";
  std::string body = "female";
  std::string out;
  double edge_length = 0.02;
  int frames = 150;
  bool video = true;
};

SewingPattern pattern_of(const std::string& name, const TailorMeasures& measures) {
  if (name == "tee") {
    return tee_pattern(measures);
  }
  if (name == "skirt") {
    return skirt_pattern(measures);
  }
  return name == "dress" ? dress_pattern(measures) : trousers_pattern(measures);
}

// What a seamstress does: the seams are closed slowly and with little weight, then the cloth hangs.
constexpr int kSewingFrames = 60;
constexpr int kFramesPerStitch = 2;   // the threads are shortened evenly, this often
constexpr double kSewingGravity = 2;  // m/s2, keeps a skirt down while its sides are drawn together
constexpr double kSewingDamping = 15;  // 1/s, so that sewing springs do not throw the cloth about
constexpr double kHangingDamping = 2;  // 1/s, to come to rest sooner

struct Draped {
  std::vector<Mesh> frames;  ///< sewing in panels, then hanging as one piece
  int sewing_frames = 0;
  FrameReport last;
};

Draped sew_and_drape(const Garment& panels, const Mesh& body, int frames) {
  Control control;
  control.body_start = control.body_end = body.vertices;
  XpbdOptions options;
  options.thickness = 0.005;  // more than a triangle of 2 cm sinks into the round of a chest
  Draped draped;
  const auto run = [&](const Cloth& cloth, ClothState state, int count) {
    ClothSolver solver(cloth, body.faces, options);
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

int run(const DrapeArguments& arguments) {
  if (arguments.out.empty()) {
    throw UsageError("it takes a folder: atelier drape --garment dress --out FOLDER");
  }
  const std::filesystem::path out = arguments.out;
  if (std::filesystem::exists(out)) {
    throw UsageError("--out cannot be '" + arguments.out +
                     "': it is there already; name a new folder");
  }
  const BodyModel human = default_human(arguments.body == "male" ? male_human() : female_human());
  const SewingPattern pattern = pattern_of(arguments.garment, tailor_measures(human));
  const Garment garment = garment_from_pattern(pattern, {.edge_length = arguments.edge_length});
  std::cout << pattern.name << ": " << pattern.panels.size() << " panels, " << pattern.seams.size()
            << " seams, " << garment.mesh.faces.rows() << " triangles\n";

  const Draped draped = sew_and_drape(garment, human.mesh, arguments.frames);
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
  if (arguments.video) {
    constexpr int kTurn = 36;
    const std::vector<Image> turn = turntable_of(dressed(last), kTurn, kFront, picture);
    write_video(out / "turntable.mp4", kTurn,
                [&](Index i) { return turn[static_cast<std::size_t>(i)]; }, {.fps = 12});
  }
  std::cout << (out / "drape.png").string() << "\n";
  return kExitDone;
}

}  // namespace

Action add_drape(CLI::App& parser) {
  auto arguments = std::make_shared<DrapeArguments>();
  parser
      .add_option("--garment", arguments->garment,
                  "Pattern, drafted to the body's measures [dress]")
      ->check(CLI::IsMember({"tee", "skirt", "dress", "trousers"}))
      ->type_name("tee|skirt|dress|trousers");
  parser.add_option("--body", arguments->body, "Default human [female]")
      ->check(CLI::IsMember({"female", "male"}))
      ->type_name("female|male");
  parser.add_option("--out", arguments->out, "New folder: sequence, meshes, pictures, video")
      ->type_name("FOLDER");
  parser.add_option("--edge-length", arguments->edge_length, "Of the cloth's triangles [0.02]")
      ->check(CLI::Range(0.008, 0.1))
      ->type_name("METRES");
  parser.add_option("--frames", arguments->frames, "60 a second; the first 60 sew [150]")
      ->check(CLI::Range(kSewingFrames + 1, 10000))
      ->type_name("N");
  parser.add_flag("!--no-video", arguments->video, "Leave out the turntable");
  return [arguments] { return run(*arguments); };
}

}  // namespace atelier

#endif
