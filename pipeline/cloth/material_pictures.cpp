#include "pipeline/cloth/material_pictures.h"

#include <cstdlib>
#include <filesystem>

#include "core/io/image_file.h"
#include "core/renamed_options.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_page.h"
#include "simulation/files/material_file.h"

namespace atelier {

std::string material_pictures(const StageStatus& own, const ReportPlaces& places) {
  const std::string width_option = "search.likelihood_width";
  double likelihood_width = 0;
  for (const ManifestOption& option : own.manifest->options) {
    if (option.name == width_option ||
        renamed_option(option.name, {width_option}) == width_option) {
      likelihood_width = std::atof(option.json.c_str());
    }
  }
  std::string html;
  for (const auto& one : read_materials(result_folder_of(own, places))) {
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
  const std::filesystem::path grid = result_folder_of(own, places) / "grid.png";
  if (std::filesystem::exists(grid)) {
    html += figure_html(read_image(grid),
                        "Trials beside what the capture shows of the frame: stretching over "
                        "columns, bending over rows");
  }
  return html.empty()
             ? ""
             : html +
                   "<p class=\"quiet\">The estimate is the posterior mean of the "
                   "logarithms under the likelihood of the distances and the prior of "
                   "published fabrics: the nearest trial of a coarse grid is often a "
                   "corner of it, since distances hardly differ (docs/methods/material.md).</p>\n";
}

}  // namespace atelier
