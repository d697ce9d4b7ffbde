#include "pipeline/report/report_pictures.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/limits.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"
#include "pipeline/report/report_drawings.h"
#include "simulation/files/material_file.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// Figures over frames of every garment, from figures.json.
std::string register_plots(const fs::path& result) {
  const fs::path file = result / "figures.json";
  if (!fs::exists(file)) {
    return "";
  }
  const nlohmann::json figures = read_json(file);
  std::string html;
  for (const auto& [name, garment] : figures.items()) {
    const JsonPlace frames = JsonPlace(garment, file.string(), name).at("frames");
    std::vector<FramePlot> plots = {{"distance to the scan, mm rms", {}, {}},
                                    {"edge strain, p95", {}, {}},
                                    {"correlation with images", {}, {}},
                                    {"inside the body, %", {}, {}}};
    constexpr std::pair<const char*, double> kNumbers[] = {
        {"scan_rms", 1e3}, {"strain_p95", 1}, {"correlation", 1}, {"inside", 100}};
    for (const auto& [frame, numbers] : frames.value().items()) {
      for (std::size_t k = 0; k < plots.size(); ++k) {
        const auto value = JsonPlace(numbers, file.string(), frame).find(kNumbers[k].first);
        if (value) {
          plots[k].frame_ids.push_back(std::atoi(frame.c_str()));
          plots[k].values.push_back(kNumbers[k].second * value->number());
        }
      }
    }
    const std::string svg = plots_svg(plots);
    html += svg.empty() ? ""
                        : "<figure>" + svg + "<figcaption>" + html_text(name) +
                              " over frames</figcaption></figure>\n";
  }
  return html;
}

/// How well each frame of the body is founded, from certificates.json.
std::string body_plots(const fs::path& result) {
  const fs::path file = result / "certificates.json";
  if (!fs::exists(file)) {
    return "";
  }
  const nlohmann::json certificates = read_json(file);
  constexpr std::pair<const char*, double> kNumbers[] = {{"outside_rate", 100},
                                                         {"outside_depth", 1e3},
                                                         {"skin_distance", 1e3},
                                                         {"proximity", 1e3},
                                                         {"seen_rate", 100}};
  std::vector<FramePlot> plots = {{"covered skin outside of the clothes, %", {}, {}},
                                  {"its depth, mm", {}, {}},
                                  {"seen skin off the body, mm", {}, {}},
                                  {"gap under clothes that are near, mm", {}, {}},
                                  {"seen, % of the body", {}, {}}};
  for (const auto& [frame, numbers] : certificates.items()) {
    for (std::size_t k = 0; k < plots.size(); ++k) {
      const auto value = JsonPlace(numbers, file.string(), frame).find(kNumbers[k].first);
      if (value) {
        plots[k].frame_ids.push_back(std::atoi(frame.c_str()));
        plots[k].values.push_back(kNumbers[k].second * value->number());
      }
    }
  }
  const std::string svg = plots_svg(plots);
  return svg.empty() ? "" : "<figure>" + svg + "<figcaption>Over frames</figcaption></figure>\n";
}

/// Some of many: every n-th of a plot's points.
FramePlot thinned(const FramePlot& all, std::size_t about) {
  FramePlot some{all.label, {}, {}};
  const std::size_t stride = 1 + all.values.size() / about;
  for (std::size_t i = 0; i < all.values.size(); i += stride) {
    some.frame_ids.push_back(all.frame_ids[i]);
    some.values.push_back(all.values[i]);
  }
  return some;
}

/// How each network came to what it is, from its training.csv: at most so many steps of it.
std::string training_plots(const StageStatus& status, const fs::path& result) {
  constexpr std::size_t kSteps = 120;
  std::string html;
  for (const ManifestOutput& output : status.manifest->outputs) {
    if (!output.path.ends_with("training.csv")) {
      continue;
    }
    FramePlot all{"PSNR of the training's pixels, dB", {}, {}};
    std::istringstream lines(read_file_text(result / output.path, Limits{}.text_file_bytes));
    std::string line;
    std::getline(lines, line);  // names of the columns
    while (std::getline(lines, line)) {
      int step = 0;
      double loss = 0;
      double psnr = 0;
      if (std::sscanf(line.c_str(), "%d,%lf,%lf", &step, &loss, &psnr) == 3) {
        all.frame_ids.push_back(step);
        all.values.push_back(psnr);
      }
    }
    const std::string svg = plots_svg({thinned(all, kSteps)});
    html += svg.empty() ? ""
                        : "<figure>" + svg + "<figcaption>" + html_text(output.path) +
                              ", over steps</figcaption></figure>\n";
  }
  return html;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream parts(line);
  for (std::string cell; std::getline(parts, cell, ',');) {
    cells.push_back(cell);
  }
  return cells;
}

/// What each simulated frame came to, from frames.csv.
std::string simulation_plots(const fs::path& result) {
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
  std::istringstream lines(read_file_text(file, Limits{}.text_file_bytes));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> names = cells_of(line);
  std::vector<FramePlot> plots;
  for (const Line& wanted : kLines) {
    plots.push_back({wanted.label, {}, {}});
  }
  while (std::getline(lines, line)) {
    const std::vector<std::string> cells = cells_of(line);
    for (std::size_t k = 0; k < plots.size(); ++k) {
      const auto column = static_cast<std::size_t>(
          std::find(names.begin(), names.end(), kLines[k].column) - names.begin());
      if (column < cells.size() && !cells[column].empty()) {
        plots[k].frame_ids.push_back(std::atoi(cells[0].c_str()));
        plots[k].values.push_back(kLines[k].scale * std::atof(cells[column].c_str()));
      }
    }
  }
  for (FramePlot& plot : plots) {
    plot = thinned(plot, kPoints);
  }
  const std::string svg = plots_svg(plots);
  return svg.empty() ? "" : "<figure>" + svg + "<figcaption>Over frames</figcaption></figure>\n";
}

/// Of each garment the nearest trial, what is within a tenth of it and within the band, and what is
/// taken, with why that is not the nearest.
std::string material_tables(const StageStatus& status, const fs::path& result) {
  double likelihood_width = 0;
  for (const ManifestOption& option : status.manifest->options) {
    likelihood_width = option.name == "search.likelihood_width" ? std::atof(option.json.c_str())
                                                                : likelihood_width;
  }
  std::string html;
  for (const auto& one : read_materials(result)) {
    const std::string& name = one.first;
    const FoundMaterial& found = one.second;  // clang 14 lets no lambda take a structured binding
    if (found.trials.empty()) {
      continue;
    }
    const StiffnessTrial& nearest = nearest_trial(found.trials);
    const auto row = [&](const char* what, const char* unit, double Stiffness::*axis,
                         double taken) {
      const auto cell = [&](const std::string& text) {
        return "<td class=\"number\">" + html_text(text + " " + unit) + "</td>";
      };
      return std::string("<tr><th>") + what + "</th>" + cell(number_text(nearest.stiffness.*axis)) +
             cell(range_text(range_within(found.trials, kTenth, axis))) +
             cell(range_text(range_within(found.trials, likelihood_width, axis))) +
             cell(number_text(found.credible_low.*axis) + " to " +
                  number_text(found.credible_high.*axis)) +
             cell(number_text(taken)) + "</tr>\n";
    };
    html += "<table><tr><th>" + html_text(name) + "</th><th>nearest trial, " +
            number_text(1e3 * nearest.distance) + " mm</th><th>within 10 % of it</th><th>within " +
            number_text(100 * likelihood_width) +
            " % (likelihood width)</th><th>90% credible interval</th><th>estimate</th></tr>\n" +
            row("stretching", "N/m", &Stiffness::stretch, found.material.stretch_warp) +
            row("bending", "N m", &Stiffness::bending, found.material.bending) + "</table>\n";
  }
  return html.empty()
             ? ""
             : html +
                   "<p class=\"quiet\">The estimate is the posterior mean of the "
                   "logarithms under the likelihood of the distances and the prior of "
                   "published fabrics: the nearest trial of a coarse grid is often a "
                   "corner of it, since distances hardly differ (docs/methods/material.md).</p>\n";
}

/// Each pattern.svg of the result, as a picture.
std::string patterns(const StageStatus& status, const fs::path& result) {
  std::string html;
  for (const ManifestOutput& output : status.manifest->outputs) {
    if (!output.path.ends_with("pattern.svg")) {
      continue;
    }
    constexpr std::int64_t kMost = 20'000'000;
    html += "<figure><img style=\"max-height:40rem\" alt=\"" + html_text(output.path) +
            "\" src=\"data:image/svg+xml;base64," +
            base64_text(read_file_bytes(result / output.path, kMost)) + "\"><figcaption>" +
            html_text(output.path) + ", to scale</figcaption></figure>\n";
  }
  return html;
}

std::string pictures_of(const StageStatus& status, const fs::path& workspace,
                        [[maybe_unused]] std::span<const StageStatus> stages) {
  const fs::path result = workspace / status.stage / folder_name(status.manifest->key);
  if (status.stage == "flatten") {
    return patterns(status, result);
  }
  if (status.stage == "material") {
    return material_tables(status, result);
  }
  std::string html;
  html = drawings_of(status.stage, ReportPlaces{workspace, stages});
  return status.stage == "register"     ? html + register_plots(result)
         : status.stage == "body"       ? html + body_plots(result)
         : status.stage == "simulate"   ? html + simulation_plots(result)
         : status.stage == "appearance" ? html + training_plots(status, result)
                                        : html;
}

}  // namespace

std::map<std::string, std::string> stage_pictures(std::span<const StageStatus> stages,
                                                  const fs::path& workspace) {
  std::map<std::string, std::string> pictures;
  for (const StageStatus& status : stages) {
    if (!status.manifest || status.state == StageStatus::State::Damaged) {
      continue;
    }
    try {
      pictures[status.stage] = pictures_of(status, workspace, stages);
    } catch (const DataError& error) {  // an image less is no reason for no report
      pictures[status.stage] =
          "<p class=\"warning\">Pictures could not be drawn: " + html_text(error.what()) + "</p>\n";
    }
  }
  return pictures;
}

}  // namespace atelier
