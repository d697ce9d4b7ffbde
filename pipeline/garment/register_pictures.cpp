#include "pipeline/garment/register_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/io/image_file.h"
#include "core/io/json.h"
#include "core/io/json_place.h"
#include "core/render/color_map.h"
#include "core/render/contact_sheet.h"
#include "core/sequence_archive.h"
#include "core/tree.h"
#include "pipeline/garment/register_holding.h"
#include "pipeline/pictures/named_views.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/report_page.h"
#include "pipeline/pictures/report_plots.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

/// How far each vertex is from the frame's scan, in colours.
std::string distance_pictures(const fs::path& result, const ReportPlaces& places) {
  const fs::path scans = maker_folder(places, "scans") / "scans";
  const fs::path registered = result / "registered";
  if (!fs::exists(registered)) {
    return "";
  }
  constexpr double kMost = 0.01;  // m
  std::string html;
  std::vector<fs::path> garments;
  for (const auto& entry : fs::directory_iterator(registered)) {
    garments.push_back(entry.path());
  }
  std::sort(garments.begin(), garments.end());
  for (const fs::path& garment : garments) {
    const Sequence sequence = open_sequence(garment);
    std::vector<CaptionedImage> cells;
    for (const int id : spread(sequence.frame_ids, kReportPictures)) {
      const fs::path file = scans / (frame_name(id) + ".h5");
      if (!fs::exists(file)) {
        continue;
      }
      const Mesh scan = read_mesh_archive(file);
      const auto at = std::find(sequence.frame_ids.begin(), sequence.frame_ids.end(), id);
      RenderMesh cloth{frame(sequence, at - sequence.frame_ids.begin()), {}};
      Eigen::VectorXd off(cloth.mesh.vertices.rows());
      const std::vector<ClosestPoint> nearest =
          closest_points(build_tree(scan.vertices, scan.faces), cloth.mesh.vertices);
      for (Index v = 0; v < off.size(); ++v) {
        off[v] = std::sqrt(nearest[static_cast<std::size_t>(v)].squared_distance);
      }
      cloth.mesh.colors = map_colors(ColorMap::Viridis, off, 0, kMost);
      cloth.mesh.normals.resize(0, 3);
      cloth.look.color = {1, 1, 1};
      cloth.look.roughness = 1;
      cells.push_back(
          {seen_in_report({cloth}, kThreeQuarter, kReportWide), "frame " + std::to_string(id)});
    }
    if (!cells.empty()) {
      cells.push_back({color_bar(ColorMap::Viridis, 0, 1e3 * kMost, "mm", kReportHeight), ""});
      html += figure_html(contact_sheet(cells, {.columns = static_cast<int>(cells.size())}),
                          garment.filename().string() + ": distance of each place from the scan");
    }
  }
  return html;
}

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
    std::vector<FramePlot> plots = {
        {"distance to the scan, mm rms", {}, {}, scaled_limit(kRegisterFigures, "scan_rms", 1e3)},
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

std::string holding_html(const fs::path& result) {
  const fs::path file = result / kHoldingPicture;
  return fs::exists(file) ? figure_html(read_image(file),
                                        "Rings by which the body holds the garments: "
                                        "bands red, resting ones blue")
                          : "";
}

}  // namespace

std::string register_pictures(const StageStatus& own, const ReportPlaces& places) {
  const fs::path result = result_folder_of(own, places);
  return holding_html(result) + distance_pictures(result, places) + register_plots(result);
}

}  // namespace atelier
