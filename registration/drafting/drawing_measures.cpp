#include "registration/drafting/drawing_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/error.h"
#include "core/topology.h"
#include "registration/outlines/outline_measures.h"

namespace atelier {
namespace {

double squared_distance_to_line(const Points2& line, const Eigen::RowVector2d& point) {
  double least = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < line.rows(); ++i) {
    const Eigen::RowVector2d a = line.row(i);
    const Eigen::RowVector2d ab = line.row((i + 1) % line.rows()) - a;
    const double t = std::clamp((point - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
    least = std::min(least, (a + t * ab - point).squaredNorm());
  }
  return least;
}

}  // namespace

std::string garment_part(const std::string& panel) {
  const std::string word = panel.substr(0, panel.find(' '));
  if (word != "sleeve" && word != "cuff") {
    return word;
  }
  for (const char* side : {" left", " right"}) {
    if (panel.find(side) != std::string::npos) {
      return word + side;
    }
  }
  return word;
}

DrawingMeasures measure_drawing(const SewingPattern& drafted, const std::vector<std::string>& names,
                                const FlatPattern& flat) {
  constexpr double kSpacing = 0.005;  // m
  const Topology topology = topology_of(flat.cut.faces, flat.vertices.rows());
  std::vector<int> panel_at(static_cast<std::size_t>(flat.vertices.rows()), -1);
  for (Index f = 0; f < flat.cut.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      panel_at[static_cast<std::size_t>(flat.cut.faces(f, k))] =
          flat.cut.panels[static_cast<std::size_t>(f)];
    }
  }
  double squares = 0;
  double points = 0;
  for (const std::vector<int>& loop : boundary_loops(topology)) {
    const std::string& name =
        names[static_cast<std::size_t>(panel_at[static_cast<std::size_t>(loop.front())])];
    const auto drawn = std::find_if(drafted.panels.begin(), drafted.panels.end(),
                                    [&](const Panel& panel) { return panel.name == name; });
    ATELIER_CHECK(drawn != drafted.panels.end(), "the pattern that was drawn of these panels");
    const Points2 outline = panel_outline(*drawn);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::RowVector2d a = flat.vertices.row(loop[i]);
      const Eigen::RowVector2d ab = flat.vertices.row(loop[(i + 1) % loop.size()]) - a;
      const double steps = std::clamp(std::ceil(ab.norm() / kSpacing), 1.0, 1000.0);
      for (double step = 0; step < steps; ++step) {
        // Each point stands for as much of the outline as lies between two.
        const double weight = ab.norm() / steps;
        squares += weight * squared_distance_to_line(outline, a + (step + 0.5) / steps * ab);
        points += weight;
      }
    }
  }
  DrawingMeasures measures;
  measures.raggedness = points > 0 ? std::sqrt(squares / points) : 0;
  std::set<std::string> parts;
  for (const std::string& name : names) {
    parts.insert(garment_part(name));
  }
  measures.parts = static_cast<int>(parts.size());
  measures.panels_a_part =
      parts.empty() ? 0 : static_cast<double>(names.size()) / static_cast<double>(parts.size());
  return measures;
}

}  // namespace atelier
