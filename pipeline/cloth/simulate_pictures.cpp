#include "pipeline/cloth/simulate_pictures.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/limits.h"
#include "core/render/contact_sheet.h"
#include "core/render/studio.h"
#include "core/sequence_archive.h"
#include "core/split_text.h"
#include "pipeline/cloth/simulation_scene.h"
#include "pipeline/pictures/named_views.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

const Eigen::Vector3f kSkin{0.62F, 0.45F, 0.36F};
const Eigen::Vector3f kCloth{0.16F, 0.24F, 0.42F};

/// Frames of the simulated garment, on the body where it can be read.
std::string strip_pictures(const StageStatus& own, const ReportPlaces& places) {
  const fs::path result = result_folder_of(own, places);
  if (!fs::exists(result / "garment" / "sequence.h5")) {
    return "";
  }
  const Sequence garment = open_sequence(result / "garment");
  std::function<Points(Index)> body;
  Triangles body_faces;
  // Where the scene is gone, or was another, the garment is shown alone.
  const fs::path folder = own.manifest->inputs.front().path;
  if (own.state == StageStatus::State::Done && fs::is_directory(folder)) {
    OptionSet set = option_set<SimulateOptions>();
    for (const ManifestOption& option : own.manifest->options) {
      const nlohmann::json value = parse_json(option.json, "manifest.json");
      set_option(set.table, option.name,
                 value.is_string() ? value.get<std::string>() : option.json);
    }
    const SimulationScene scene =
        read_scene_body(scene_in(folder), options_of<SimulateOptions>(set));
    body = scene.body;
    body_faces = scene.body_faces;
  }
  std::vector<CaptionedImage> cells;
  constexpr std::size_t kStrip = 6;
  for (const int id : spread(garment.frame_ids, kStrip)) {
    const auto at = std::find(garment.frame_ids.begin(), garment.frame_ids.end(), id);
    RenderMesh cloth{frame(garment, at - garment.frame_ids.begin()), clay_look()};
    cloth.look.color = kCloth;
    std::vector<RenderMesh> scene = {cloth};
    if (body) {
      RenderMesh wearer;
      wearer.mesh.vertices = body(id);
      wearer.mesh.faces = body_faces;
      wearer.look.color = kSkin;
      scene.push_back(std::move(wearer));
    }
    cells.push_back(
        {seen_in_report(scene, kThreeQuarter, kReportNarrow), "frame " + std::to_string(id)});
  }
  // `simulate` reads no result of `material`.
  const StageStatus* material = sound_maker(places, "fitted_material");
  const bool fitted = material != nullptr && material->manifest->metrics.contains("fitted") &&
                      material->manifest->metrics.at("fitted") > 0;
  return figure_html(
      contact_sheet(cells, {.columns = static_cast<int>(kStrip)}),
      std::string("The simulated garment") +
          (fitted ? ", of the fabric that this stage's options say: animate takes the "
                    "one that material fitted"
                  : ""));
}

/// The solver of a result; of one that does not say it, the first there was.
std::string solver_of_result(const StageStatus& own) {
  for (const ManifestOption& option : own.manifest->options) {
    const nlohmann::json value = parse_json(option.json, "manifest.json");
    if (option.name == "solver" && value.is_string()) {
      return value.get<std::string>();
    }
  }
  return SolverOptions{}.name;
}

/// Plots of the figures of each simulated frame, from frames.csv. Residuals are of the
/// default solver's constraints: of another one they are not drawn, also where an older build wrote
/// zeros.
std::string simulation_plots(const StageStatus& own, const fs::path& result) {
  const fs::path file = result / "frames.csv";
  if (!fs::exists(file)) {
    return "";
  }
  struct Line {
    const char* column;
    const char* label;
    double scale;
  };
  constexpr Line kLines[] = {{"strain_p95", "edge strain, p95, %", 100},
                             {"strain_max", "edge strain, maximum, %", 100},
                             {"kinetic_energy_j", "kinetic energy, J", 1},
                             {"spring_residual_m", "residual of springs, mm rms", 1e3},
                             {"strain_residual", "residual of strain, % rms", 100},
                             {"inside", "vertices inside the body", 1},
                             {"inside_depth_m", "the deepest of them, mm", 1e3},
                             {"body_crossings", "edges crossed, cloth and body", 1},
                             {"body_gap", "minimum gap to the body, of the thickness", 1},
                             {"crossings", "edges crossed, cloth and cloth", 1},
                             {"self_gap", "minimum gap between layers, of the thickness", 1}};
  constexpr std::size_t kPoints = 240;
  const std::vector<std::string> lines =
      split_text(read_file_text(file, Limits{}.text_file_bytes), '\n');
  const std::vector<std::string> names = lines.empty() ? lines : split_text(lines.front(), ',');
  const std::string solver = solver_of_result(own);
  const bool has_residuals = solver == SolverOptions{}.name;
  std::vector<FramePlot> plots;
  for (const Line& wanted : kLines) {
    plots.push_back(
        {wanted.label, {}, {}, scaled_limit(kSimulateFigures, wanted.column, wanted.scale)});
  }
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> cells = split_text(lines[i], ',');
    for (std::size_t k = 0; k < plots.size(); ++k) {
      const auto column = static_cast<std::size_t>(
          std::find(names.begin(), names.end(), kLines[k].column) - names.begin());
      const bool measured =
          has_residuals || std::string(kLines[k].column).find("residual") == std::string::npos;
      if (measured && column < cells.size() && !cells[column].empty()) {
        plots[k].frame_ids.push_back(std::atoi(cells[0].c_str()));
        plots[k].values.push_back(kLines[k].scale * std::atof(cells[column].c_str()));
      }
    }
  }
  for (FramePlot& plot : plots) {
    plot = thinned(plot, kPoints);
  }
  const std::string svg = plots_svg(plots);
  return svg.empty() ? ""
                     : "<figure>" + svg + "<figcaption>Over frames" +
                           (has_residuals ? ""
                                          : "; residuals are of constraints of " +
                                                std::string(SolverOptions{}.name) + ", " +
                                                html_text(solver) + " measures none") +
                           "</figcaption></figure>\n";
}

}  // namespace

std::string simulate_pictures(const StageStatus& own, const ReportPlaces& places) {
  return strip_pictures(own, places) + simulation_plots(own, result_folder_of(own, places));
}

}  // namespace atelier
