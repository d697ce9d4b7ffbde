#include "pipeline/draping/drape.h"

#include <algorithm>
#include <array>
#include <memory>

#include "bodymodel/formats/body_file.h"
#include "core/error.h"
#include "core/garment_archive.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "core/usage_error.h"
#include "pipeline/outfit/fitting.h"
#include "simulation/cloth/solver_sections.h"

namespace atelier {
namespace {

constexpr double kSettlingDamping = 2;  // 1/s, to come to rest sooner
constexpr int kPicturesOfDressing = 3;

bool is_default_human(const DrapeOptions& options) {
  return options.body == "female" || options.body == "male";
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

}  // namespace

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
      "solver", options.settling.name, solver_names(),
      "Simulator by which the dressed cloth comes to rest; panels are sewn by the default one");
  table.add(describe_sections(options.settling));
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

void require_used_options(const DrapeOptions& options) {
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
  const std::string& solver = options.settling.name;
  if (const std::string conflict = solver_conflict(options.settling, options.device);
      !conflict.empty()) {
    throw UsageError("--solver " + solver + ": " + conflict);
  }
  if (const std::string idle = option_without_effect(options.settling, options.device);
      !idle.empty()) {
    throw UsageError(solver_flag(idle, "", options.settling) +
                     " does nothing on the CPU; use --device cuda, or leave it out");
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

Draped dress_and_settle(const DrapeOptions& options,
                        const std::function<void(std::size_t frame)>& dressing) {
  Draped draped;
  draped.body = wearer_of(options);
  std::vector<Snapshot> seen;
  draped.outfit =
      dress_body(draped.body, options.outfit, options.body, options.device,
                 [&](const Mesh& cloth, const Points& body) {
                   dressing(seen.size());
                   seen.push_back({"dressing " + std::to_string(seen.size()), cloth, body});
                 });
  for (int i = 0; i < kPicturesOfDressing && !seen.empty(); ++i) {
    const std::size_t at = (seen.size() - 1) * static_cast<std::size_t>(i) / kPicturesOfDressing;
    draped.dressing.push_back(seen[at]);
  }
  SolverOptions solver = solved_as(draped.outfit.solver, options.settling);
  solver.self_interval = search_interval(solver.substeps);
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

void write_draped(const std::filesystem::path& folder, const Draped& draped, bool video) {
  write_garments(folder, draped);
  write_mesh(folder / "body.obj", draped.body.mesh);
  write_pictures(folder, draped, video);
}

}  // namespace atelier
