#if defined(ATELIER_HAS_CORE_RENDER) && defined(ATELIER_HAS_SIMULATION)

#include "apps/simulate.h"

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/exit_code.h"
#include "apps/output_place.h"
#include "apps/usage_error.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/image_file.h"
#include "core/io/mesh_file.h"
#include "core/io/usd_sequence.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/render/video.h"
#include "core/sequence_archive.h"
#include "simulation/bending_rigidity.h"

namespace atelier {
namespace {

using Json = nlohmann::json;

Json json_of(const FrameReport& r) {
  Json json = {{"frame", r.frame},
               {"strain", {{"p50", r.strain_p50}, {"p95", r.strain_p95}, {"max", r.strain_max}}},
               {"residual", {{"spring_m", r.spring_residual}, {"hinge_rad", r.hinge_residual}}},
               {"energy_j", {{"kinetic", r.kinetic_energy}, {"elastic", r.elastic_energy}}},
               {"body",
                {{"contacts", r.body_contacts},
                 {"inside", r.penetrating},
                 {"depth_m", r.penetration_depth}}},
               {"self",
                {{"contacts", r.self_contacts},
                 {"candidates", r.self_candidates},
                 {"self_searches", r.self_searches}}}};
  json["self"]["crossings"] = r.crossings >= 0 ? Json(r.crossings) : Json(nullptr);
  json["body"]["crossings"] = r.body_crossings >= 0 ? Json(r.body_crossings) : Json(nullptr);
  return json;
}

std::string line_of(const FrameReport& r) {
  char text[320];
  std::snprintf(
      text, sizeof text,
      "frame %lld: strain p50 %.2f%% p95 %.2f%% max %.2f%%; %d inside the body (%.2f mm), "
      "%d touch it, %d touch cloth; energy %.3g J; residual %.2g mm, %.2g rad",
      static_cast<long long>(r.frame), 100 * r.strain_p50, 100 * r.strain_p95, 100 * r.strain_max,
      r.penetrating, 1e3 * r.penetration_depth, r.body_contacts, r.self_contacts,
      r.kinetic_energy + r.elastic_energy, 1e3 * r.spring_residual, r.hinge_residual);
  std::string line = text;
  if (r.crossings >= 0) {
    line += "; " + std::to_string(r.crossings) + " crossings with itself";
  }
  if (r.body_crossings >= 0) {
    line += ", " + std::to_string(r.body_crossings) + " with the body";
  }
  return line;
}

std::vector<RenderMesh> dressed(const Mesh& garment, const SimulationScene& scene,
                                const Points& body) {
  Look cloth = clay_look();
  cloth.color = {0.16f, 0.24f, 0.42f};
  std::vector<RenderMesh> meshes;
  meshes.push_back({garment, cloth});
  if (scene.body_faces.rows() > 0) {
    Mesh wearer;
    wearer.vertices = body;
    wearer.faces = scene.body_faces;
    meshes.push_back({wearer, clay_look()});
  }
  return meshes;
}

PictureOptions picture_size() {
  PictureOptions options;
  options.width = 360;
  options.height = 540;
  return options;
}

Mesh garment_mesh(const Cloth& cloth, const ClothState& state) {
  Mesh mesh;
  mesh.vertices = state.positions;
  mesh.faces = cloth.faces;
  return mesh;
}

/// The grid of the paper's Fig. 1: stretching stiffness over columns, bending over rows.
int simulate_grid(const std::filesystem::path& out, const SimulationScene& scene,
                  const Cloth& cloth, const SimulateOptions& options, Device device) {
  const std::vector<double> factors{0.1, 1, 10};
  std::vector<ClothVariation> variations;
  for (const double bending : factors) {
    for (const double stretch : factors) {
      variations.push_back({stretch, bending, -1});
    }
  }
  XpbdOptions solver = scene_solver(options);
  solver.report = false;
  ClothSweep sweep(cloth, variations, scene.body_faces, solver, device);
  for (Index frame = 1; frame <= scene.frame_count; ++frame) {
    sweep.advance(scene_control(scene, options, frame));
  }
  const Points body = scene.body ? scene.body(scene.frame_count) : Points(0, 3);
  std::vector<CaptionedImage> pictures;
  for (int i = 0; i < sweep.scene_count(); ++i) {
    const ClothVariation& v = variations[static_cast<std::size_t>(i)];
    char caption[80];
    std::snprintf(caption, sizeof caption, "stretch %g N/m, bend %g N m",
                  v.stretch * cloth.material.stretch_warp, v.bending * cloth.material.bending);
    pictures.push_back({picture_of(dressed(garment_mesh(cloth, sweep.state(i)), scene, body),
                                   kThreeQuarter, picture_size()),
                        caption});
  }
  ContactSheetOptions sheet;
  sheet.columns = static_cast<int>(factors.size());
  sheet.title = "Stretching over columns, bending over rows";
  write_image(out / "grid.png", contact_sheet(pictures, sheet));
  std::cout << (out / "grid.png").string() << "\n";
  return kExitDone;
}

/// Writes frames as they come, in the format asked for, and what has to wait at the end.
class FrameWriter {
 public:
  FrameWriter(std::filesystem::path out, std::string format, double fps, Index count,
              const Triangles& faces)
      : out_(std::move(out)), format_(std::move(format)) {
    header_.fps = fps;
    for (Index i = 1; i <= count; ++i) {
      header_.frame_ids.push_back(static_cast<int>(i));
    }
    header_.shared.faces = faces;
    make_private_directory(out_);
    if (in_archive()) {
      write_sequence_header(out_ / "garment", header_);
    }
  }

  void write(int frame, const Mesh& mesh) {
    if (in_archive()) {
      write_sequence_frame(out_ / "garment", header_, frame, mesh);
      return;
    }
    char name[40];
    std::snprintf(name, sizeof name, "garment_%06d.%s", frame, format_.c_str());
    write_mesh(out_ / name, mesh);
  }

  void finish() {
    if (format_ == "usda") {
      write_usd_sequence(out_ / "garment.usda", open_sequence(out_ / "garment"));
    }
  }

 private:
  // USD is one file, which would be lost with the run: its frames are kept as ours until the end.
  bool in_archive() const { return format_ == "h5" || format_ == "usda"; }

  std::filesystem::path out_;
  std::string format_;
  SequenceHeader header_;
};

/// Pictures along the way, and two videos: of the motion and once round the end.
class Album {
 public:
  Album(std::filesystem::path out, Index count, double fps)
      : out_(std::move(out)),
        every_(std::max<Index>(1, count / 8)),
        film_every_(std::max<Index>(1, static_cast<Index>(std::lround(fps / 15)))),
        count_(count),
        film_fps_(fps / static_cast<double>(film_every_)) {}

  void add(Index frame, const Mesh& garment, const SimulationScene& scene) {
    const bool last = frame == count_;
    if (frame % every_ != 0 && frame % film_every_ != 0 && frame != 1 && !last) {
      return;
    }
    std::vector<RenderMesh> meshes =
        dressed(garment, scene, scene.body ? scene.body(frame) : Points(0, 3));
    if (frame % every_ == 0 || frame == 1 || last) {
      pictures_.push_back(
          {picture_of(meshes, kThreeQuarter, picture_size()), "frame " + std::to_string(frame)});
    }
    if (frame % film_every_ == 0) {
      film_.push_back(meshes);
    }
    if (last) {
      end_ = std::move(meshes);
    }
  }

  void finish() const {
    ContactSheetOptions sheet;
    sheet.columns = 5;
    write_image(out_ / "sheet.png", contact_sheet(pictures_, sheet));
    constexpr int kTurn = 36;
    const std::vector<Image> turn = turntable_of(end_, kTurn, kFront, picture_size());
    write_video(out_ / "turntable.mp4", kTurn,
                [&](Index i) { return turn[static_cast<std::size_t>(i)]; }, {.fps = 12});
    write_video(out_ / "motion.mp4", static_cast<Index>(film_.size()),
                [&](Index i) {
                  return picture_of(film_[static_cast<std::size_t>(i)], kThreeQuarter,
                                    picture_size());
                },
                {.fps = film_fps_});
  }

 private:
  std::filesystem::path out_;
  Index every_;
  Index film_every_;
  Index count_;
  double film_fps_;
  std::vector<CaptionedImage> pictures_;
  std::vector<std::vector<RenderMesh>> film_;
  std::vector<RenderMesh> end_;
};

void say_mesh(const Cloth& cloth, const Garment& garment, bool json) {
  const BendingRigidity rigidity = bending_rigidity(garment);
  if (json) {
    std::cout << Json({{"vertices", cloth.rest_positions.rows()},
                       {"faces", cloth.faces.rows()},
                       {"bending_by_direction", rigidity.by_direction}})
                     .dump()
              << "\n";
    return;
  }
  char text[240];
  std::snprintf(text, sizeof text,
                "%lld vertices, %lld triangles; by direction their hinges are %.2f to %.2f of the "
                "fabric's bending stiffness (mean %.2f)",
                static_cast<long long>(cloth.rest_positions.rows()),
                static_cast<long long>(cloth.faces.rows()), rigidity.lowest, rigidity.highest,
                rigidity.mean);
  std::cout << text << "\n";
}

}  // namespace

int simulate_alone(const std::map<std::string, std::string>& values, const OptionSet& set,
                   Device device, bool json) {
  const auto value = [&](const char* name) {
    const auto found = values.find(name);
    return found != values.end() ? found->second : std::string();
  };
  SimulateOptions options = options_of<SimulateOptions>(set);
  const ScenePaths paths{value("garment"), value("body"), value("motion")};
  const std::filesystem::path out = value("out");
  const std::string format = value("format").empty() ? "h5" : value("format");
  if (paths.garment.empty() || out.empty()) {
    throw UsageError(
        "it takes a garment and a folder: atelier simulate --garment MESH --out FOLDER");
  }
  require_folder_place(out);
  if (format != "h5" && format != "ply" && format != "obj" && format != "usda") {
    throw UsageError("--format cannot be '" + format + "': it takes h5, ply, obj or usda");
  }
  if (!value("material").empty()) {
    OptionTable table = describe(options);
    const std::string problem = set_option(table, "material.name", value("material"));
    if (!problem.empty()) {
      throw UsageError(problem);
    }
  }
  const SimulationScene scene = read_scene(paths, options);
  for (const std::string& note : scene.notes) {
    (json ? std::cerr : std::cout) << note << "\n";
  }
  const Cloth cloth = scene_cloth(scene, options);
  say_mesh(cloth, scene.garment, json);
  if (value("grid") == "true") {
    make_private_directory(out);
    return simulate_grid(out, scene, cloth, options, device);
  }
  FrameWriter writer(out, format, options.fps, scene.frame_count, cloth.faces);
  Album album(out, scene.frame_count, options.fps);
  const bool pictures = value("no-pictures") != "true";
  ClothSolver solver(cloth, scene.body_faces, scene_solver(options), device);
  for (Index frame = 1; frame <= scene.frame_count; ++frame) {
    const FrameReport report = [&] {
      try {
        return solver.advance(scene_control(scene, options, frame));
      } catch (const DataError& error) {
        throw DataError(error.file.empty() ? paths.garment.string() : error.file, error.where,
                        error.found, error.expected + "; frames before it are in " + out.string());
      }
    }();
    const Mesh mesh = garment_mesh(cloth, solver.state());
    writer.write(static_cast<int>(frame), mesh);
    std::cout << (json ? json_of(report).dump() : line_of(report)) << std::endl;
    if (pictures) {
      album.add(frame, mesh, scene);
    }
  }
  writer.finish();
  if (pictures) {
    album.finish();
  }
  if (!json) {
    std::cout << out.string() << "\n";
  }
  return kExitDone;
}

}  // namespace atelier

#endif
