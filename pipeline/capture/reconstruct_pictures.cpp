#include "pipeline/capture/reconstruct_pictures.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "core/render/color_map.h"
#include "core/render/contact_sheet.h"
#include "core/sequence_archive.h"
#include "pipeline/pictures/named_views.h"
#include "pipeline/pictures/report_drawings.h"
#include "pipeline/pictures/validate_drawings.h"

namespace atelier {

namespace fs = std::filesystem;

std::string reconstruct_pictures(const StageStatus& own, const ReportPlaces& places) {
  std::string html;
  const Dataset dataset = dataset_of(own);
  html = "<figure>" + camera_layout_svg(dataset, {}, {}) +
         "<figcaption>Positions and directions of the cameras</figcaption></figure>\n";
  std::vector<fs::path> scans;
  const fs::path folder = result_folder_of(own, places) / "scans";
  if (!fs::exists(folder)) {
    return html;
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    scans.push_back(entry.path());
  }
  std::sort(scans.begin(), scans.end());
  if (scans.empty()) {
    return html;
  }
  const fs::path& file = scans[scans.size() / 3];
  const Mesh scan = read_mesh_archive(file);
  Look plain;
  plain.roughness = 0.9F;
  plain.color = {0.9F, 0.9F, 0.9F};
  const std::optional<ReportedTrack> tracked = reported_track(places, dataset);
  const auto [front, back] = two_sides(tracked_facing(tracked, std::atoi(file.stem().c_str())));
  std::vector<CaptionedImage> cells = {
      {seen_in_report({{scan, plain}}, front.view, kReportWide), front.name},
      {seen_in_report({{scan, plain}}, back.view, kReportWide), back.name}};
  if (!scan.labels.empty()) {
    Mesh labelled = scan;
    labelled.colors.resize(scan.vertices.rows(), 3);
    for (Index v = 0; v < scan.vertices.rows(); ++v) {
      constexpr double kLabels = 9;
      labelled.colors.row(v) =
          map_color(ColorMap::Turbo, scan.labels[static_cast<std::size_t>(v)] / kLabels)
              .transpose();
    }
    cells.push_back({seen_in_report({{labelled, plain}}, front.view, kReportWide), "labels"});
    cells.push_back({seen_in_report({{labelled, plain}}, back.view, kReportWide), "labels"});
  }
  return html + figure_html(contact_sheet(cells, {.columns = 4}),
                            "The surface of frame " + file.stem().string());
}

}  // namespace atelier
