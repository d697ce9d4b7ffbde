#include "pipeline/draping/drape.h"

#include <cstdio>
#include <iostream>
#include <memory>

#include "apps/console/arguments.h"
#include "apps/console/command.h"
#include "apps/console/option_flags.h"
#include "bodymodel/measure.h"
#include "core/atomic_file.h"
#include "core/exit_code.h"
#include "core/io/lower_extension.h"
#include "core/printable.h"
#include "core/store/output_place.h"
#include "core/store/unfinished_folder.h"
#include "core/usage_error.h"
#include "core/writable_place.h"
#include "simulation/contact/crossings.h"

namespace atelier {
namespace {

constexpr double kTight = 0.15;  // strain p95 from which clothes are said to be tight; our choice

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
  require_used_options(options);
  const Draped draped = dress_and_settle(options, [](std::size_t frame) {
    if (frame % 30 == 0) {
      std::cout << "dressing: frame " << frame << std::endl;
    }
  });
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
  write_draped(folder, draped, options.video);
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
