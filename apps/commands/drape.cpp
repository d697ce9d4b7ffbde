#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "bodymodel/formats/body_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/measure.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exit_code.h"
#include "core/garment_archive.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/io/mesh_file.h"
#include "core/printable.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "pipeline/outfit/dressing.h"
#include "pipeline/outfit/fitting.h"
#include "simulation/contact/crossings.h"
#include "simulation/solver.h"

namespace atelier {
namespace {

constexpr double kAtRest = 0.01;        // m/s at most, that 99 of 100 vertices move
constexpr double kSettlingDamping = 2;  // 1/s, to come to rest sooner
constexpr int kPicturesOfDressing = 3;
constexpr double kTight = 0.15;  // strain p95 from which clothes are said to be tight; our choice

struct DrapeOptions {
  std::string body = "female";
  std::string fit = "garment";
  int frames = 240;   ///< at most, 60 a second, once the garment is on
  bool video = true;  ///< a turntable, which takes as long as the rest
  double rest_speed = kAtRest;
  std::string solver = solver_names().front();  ///< by which the dressed cloth comes to rest
  Device device = Device::Cpu;
  OutfitOptions outfit;
  DefaultHumanOptions human;
};

OptionTable describe(DrapeOptions& options) {
  OptionTable table;
  table.add(
      "body", options.body, std::vector<std::string>{},
      "Body that wears the garments: female or male of the default human, or a body model file");
  table.add("fit", options.fit, {"garment", "body"},
            "Treatment of pattern files that are too tight: garment refuses them with advice, body "
            "slims the default human");
  table.add("frames", options.frames, 1, 10000, "",
            "Maximum number of frames, at 60 per second, for the dressed cloth to come to rest");
  table.add("rest_speed", options.rest_speed, 1e-4, 10, "m/s",
            "Speed below which 99% of the vertices must be for the cloth to be at rest");
  table.add("video", options.video, "Turntable video beside the images");
  table.add(
      "solver", options.solver, solver_names(),
      "Simulator by which the dressed cloth comes to rest; panels are sewn by the default one");
  table.add("device", options.device, {{"cpu", Device::Cpu}, {"cuda", Device::Cuda}},
            "Device of the cloth simulation");
  OptionTable human = describe(options.human);
  std::erase_if(human.fields, [](const OptionField& field) {
    return field.name == "male" || field.name == "shape_basis";
  });
  table.add("human", human);
  OptionTable outfit = describe(options.outfit);
  std::erase_if(outfit.fields, [](const OptionField& field) {
    return field.name == "rate" || field.name == "substeps";
  });
  return table.add(outfit);
}

bool is_default_human(const DrapeOptions& options) {
  return options.body == "female" || options.body == "male";
}

/// Refuses what is said and would do nothing to these garments on this body.
void require_used(const DrapeOptions& options) {
  const auto garments = outfit_garments(options.outfit.garment);
  const bool of_file = std::any_of(garments.begin(), garments.end(), [](const auto& garment) {
    return garment.first.ends_with(".json");
  });
  if (options.outfit.pattern_scale != 1 && !of_file) {
    throw UsageError(
        "--pattern-scale does nothing without a pattern file (.json): drafted garments have the "
        "body's own size; leave it out");
  }
  if (options.fit == "body" && !of_file) {
    throw UsageError(
        "--fit body does nothing without a pattern file (.json): drafted garments fit as they are; "
        "leave it out");
  }
  SolverOptions settling;
  settling.name = options.solver;
  if (const std::string conflict = solver_conflict(settling, options.device); !conflict.empty()) {
    throw UsageError("--solver " + options.solver + ": " + conflict);
  }
  if (is_default_human(options)) {
    return;
  }
  if (options.fit == "body") {
    throw UsageError("--fit body slims the default human alone, not '" + options.body +
                     "'; leave it out, or --body female or male");
  }
  DrapeOptions said = options;
  DrapeOptions usual;
  const OptionTable texts = describe(said.human);
  const OptionTable defaults = describe(usual.human);
  for (std::size_t i = 0; i < texts.fields.size(); ++i) {
    if (option_text(texts.fields[i]) != option_text(defaults.fields[i])) {
      throw UsageError("--human." + texts.fields[i].name + " shapes the default human, not '" +
                       options.body + "'; leave it out, or --body female or male");
    }
  }
}

/// The wearer; a default human is sized to what it is to wear if `fit` says so.
BodyModel wearer_of(const DrapeOptions& options) {
  if (!is_default_human(options)) {
    return read_body_file(options.body).model;
  }
  DefaultHumanOptions human = options.human;
  human.male = options.body == "male" ? 1 : 0;
  human.shape_basis = false;
  const std::string problem = human_options_problem(human);
  if (!problem.empty()) {
    throw UsageError("--human." + problem);
  }
  BodyModel body = default_human(human);
  if (options.fit != "body") {
    return body;
  }
  for (const auto& [name, label] : outfit_garments(options.outfit.garment)) {
    if (!name.ends_with(".json")) {
      continue;
    }
    Garment panels = cut_panels(name, body, options.outfit);
    place_round_body(panels, body, body.mesh.vertices);
    const std::vector<GirthFit> fits = girth_fits(panels, body);
    if (!what_is_tight(fits).empty()) {
      human = human_that_fits(fits, human);
      body = default_human(human);
    }
  }
  return body;
}

/// Speed that 99 vertices in 100 do not exceed.
double speed_of(const ClothState& state) {
  std::vector<double> speeds;
  for (Index v = 0; v < state.velocities.rows(); ++v) {
    speeds.push_back(state.velocities.row(v).norm());
  }
  const auto at = static_cast<std::ptrdiff_t>(speeds.size() - 1 - speeds.size() / 100);
  std::nth_element(speeds.begin(), speeds.begin() + at, speeds.end());
  return speeds[static_cast<std::size_t>(at)];
}

/// How a garment was put on, a picture's worth at a time.
struct Snapshot {
  std::string caption;
  Mesh cloth;
  Points body;
};

struct Draped {
  BodyModel body;
  Outfit outfit;
  std::vector<Snapshot> dressing;
  std::vector<Mesh> frames;  ///< of the dressed cloth coming to rest
  double speed = 0;          ///< m/s at the end
  FrameReport last;
};

Draped dress_and_settle(const DrapeOptions& options) {
  Draped draped;
  draped.body = wearer_of(options);
  std::vector<Snapshot> seen;
  draped.outfit =
      dress_body(draped.body, options.outfit, options.body, options.device,
                 [&](const Mesh& cloth, const Points& body) {
                   if (seen.size() % 30 == 0) {
                     std::cout << "dressing: frame " << seen.size() << std::endl;
                   }
                   seen.push_back({"dressing " + std::to_string(seen.size()), cloth, body});
                 });
  for (int i = 0; i < kPicturesOfDressing && !seen.empty(); ++i) {
    const std::size_t at = (seen.size() - 1) * static_cast<std::size_t>(i) / kPicturesOfDressing;
    draped.dressing.push_back(seen[at]);
  }
  SolverOptions solver = draped.outfit.solver;
  solver.name = options.solver;
  solver.time_step = 1.0 / 60;
  solver.velocity_damping = kSettlingDamping;
  const std::unique_ptr<Solver> hang =
      create_solver({draped.outfit.cloth, draped.body.mesh.faces}, solver, options.device);
  hang->set_state(draped.outfit.state);
  Control control;
  control.body_start = control.body_end = draped.body.mesh.vertices;
  Mesh mesh;
  mesh.faces = draped.outfit.cloth.faces;
  for (int i = 0; i < options.frames; ++i) {
    draped.last = hang->step(control);
    const ClothState state = hang->state();
    mesh.vertices = state.positions;
    draped.frames.push_back(mesh);
    draped.speed = speed_of(state);
    if (draped.speed < options.rest_speed) {
      break;
    }
  }
  return draped;
}

/// The rows of one garment of the outfit, with its own faces and atlas.
Mesh garment_in(const Draped& draped, std::size_t garment, const Mesh& all) {
  Mesh mesh = draped.outfit.garments[garment].garment.mesh;
  mesh.vertices = all.vertices.middleRows(draped.outfit.first[garment], mesh.vertices.rows());
  return mesh;
}

void write_garments(const std::filesystem::path& out, const Draped& draped) {
  const bool one = draped.outfit.garments.size() == 1;
  for (std::size_t g = 0; g < draped.outfit.garments.size(); ++g) {
    const std::string name = one ? "garment" : draped.outfit.garments[g].garment.name;
    std::vector<Mesh> frames;
    for (const Mesh& all : draped.frames) {
      frames.push_back(garment_in(draped, g, all));
    }
    write_mesh(out / (name + ".obj"), frames.back());
    Garment garment = draped.outfit.garments[g].garment;  // with its flat panels, for strain
    garment.mesh.vertices = frames.back().vertices;
    write_garment_archive(out / (name + ".h5"), garment);
    write_sequence(out / name, sequence_of(std::move(frames), 60));
  }
}

void write_pictures(const std::filesystem::path& out, const Draped& draped, bool video) {
  constexpr std::array<std::array<float, 3>, 3> kColors = {
      {{0.16F, 0.24F, 0.42F}, {0.45F, 0.16F, 0.14F}, {0.14F, 0.34F, 0.20F}}};
  PictureOptions picture;
  picture.width = 400;
  picture.height = 600;
  const auto look = [&](std::size_t garment) {
    Look cloth = clay_look();
    const auto& color = kColors[garment % kColors.size()];
    cloth.color = {color[0], color[1], color[2]};
    return cloth;
  };
  std::vector<CaptionedImage> cells;
  for (const Snapshot& snapshot : draped.dressing) {
    Mesh body = draped.body.mesh;
    body.vertices = snapshot.body;
    const std::vector<RenderMesh> scene{{body, clay_look()}, {snapshot.cloth, look(0)}};
    cells.push_back({picture_of(scene, kThreeQuarter, picture), snapshot.caption});
  }
  std::vector<RenderMesh> dressed{{draped.body.mesh, clay_look()}};
  for (std::size_t g = 0; g < draped.outfit.garments.size(); ++g) {
    dressed.push_back({garment_in(draped, g, draped.frames.back()), look(g)});
  }
  cells.push_back({picture_of(dressed, kThreeQuarter, picture),
                   "at rest, frame " + std::to_string(draped.frames.size())});
  cells.push_back({picture_of(dressed, kFront, picture), "front"});
  cells.push_back({picture_of(dressed, kSide, picture), "side"});
  cells.push_back({picture_of(dressed, kBack, picture), "back"});
  std::string names;
  for (const GroundTruthGarment& one : draped.outfit.garments) {
    names += (names.empty() ? "" : " and ") + one.garment.name;
  }
  write_image(out / "drape.png",
              contact_sheet(cells, {.columns = 4, .title = names + ", sewn and draped"}));
  if (video) {
    constexpr int kTurn = 36;
    const std::vector<Image> turn = turntable_of(dressed, kTurn, kFront, picture);
    write_video(out / "turntable.mp4", kTurn,
                [&](Index i) { return turn[static_cast<std::size_t>(i)]; }, {.fps = 12});
  }
}

int run(const std::filesystem::path& out, const DrapeOptions& options) {
  if (out.empty()) {
    throw UsageError("drape takes --out: atelier drape --garment dress --out FOLDER");
  }
  for (const char* file : {".obj", ".ply", ".glb", ".h5", ".usda", ".png", ".jpg", ".mp4"}) {
    if (lower_extension(out) == file) {
      throw UsageError("--out cannot be '" + out.string() +
                       "': meshes, images and a video go into one new folder; name that");
    }
  }
  require_new_place(out, "--out");
  require_folder_place(out);
  require_used(options);
  const Draped draped = dress_and_settle(options);
  const BodyMeasurements measures = measure_body(draped.body);
  char text[400];
  std::snprintf(text, sizeof text, "body: %.2f m, %.1f kg, chest %.2f m, waist %.2f m, hips %.2f m",
                measures.stature, measures.mass, measures.chest_girth, measures.waist_girth,
                measures.hip_girth);
  std::cout << text << "\n";
  for (const GroundTruthGarment& one : draped.outfit.garments) {
    std::cout << printable(one.garment.name) << ": " << one.garment.panel_names.size()
              << " panels, " << one.seams.size() << " seams, " << one.garment.mesh.faces.rows()
              << " triangles\n";
  }
  const int crossings = count_crossings(draped.frames.back().vertices, draped.outfit.cloth.faces);
  std::snprintf(text, sizeof text,
                "%s after %zu frames (%.3f m/s): strain p50 %.2f%%, p95 %.2f%%; %d vertices inside "
                "the body, %.2f mm at most; %d crossings of cloth with itself",
                draped.speed < options.rest_speed ? "at rest" : "NOT at rest", draped.frames.size(),
                draped.speed, 100 * draped.last.strain_p50, 100 * draped.last.strain_p95,
                draped.last.penetrating, 1000 * draped.last.penetration_depth, crossings);
  std::cout << text << "\n";
  if (draped.last.strain_p95 > kTight) {
    std::cout
        << "warning: the clothes are tight: a twentieth of their edges is stretched by more than "
        << static_cast<int>(100 * kTight)
        << "%; --pattern-scale makes them larger, --fit body the body slimmer\n";
  }
  const UnfinishedFolder unfinished(out);  // one that is half there would stand in the way
  const std::filesystem::path folder = unfinished.content();
  make_private_directory(folder);
  write_garments(folder, draped);
  write_mesh(folder / "body.obj", draped.body.mesh);
  write_pictures(folder, draped, options.video);
  unfinished.finish();
  std::cout << (out / "drape.png").string() << "\n";
  return kExitDone;
}

}  // namespace

OptionSet drape_options() {
  return option_set<DrapeOptions>();
}

Action add_drape(CLI::App& parser) {
  const auto out = std::make_shared<std::string>();
  add_option(parser, "--out", *out, "New folder for the sequence, meshes, images and video")
      .type_name("FOLDER");
  const OptionReader options = add_option_flags(parser, drape_options());
  return [out, options] { return run(*out, options_of<DrapeOptions>(options())); };
}

}  // namespace atelier
