#include "registration/sewing/pattern_garment.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "registration/sewing/panel_triangulation.h"

namespace atelier {
namespace {

// Where an edge's points lie among the garment's vertices, from its start to its end.
using EdgeVertices = std::map<std::pair<int, int>, std::vector<int>>;

// Segments of every edge: as many on both sides of a seam.
std::map<std::pair<int, int>, int> segment_counts(const SewingPattern& pattern,
                                                  double edge_length_m) {
  std::map<std::pair<int, int>, int> counts;
  const auto segments = [&](int panel, int edge) {
    const double length = edge_length(pattern.panels[static_cast<std::size_t>(panel)], edge);
    return std::max(1, saturating_cast<int>(std::round(length / edge_length_m)));
  };
  for (int panel = 0; panel < static_cast<int>(pattern.panels.size()); ++panel) {
    const int edges =
        static_cast<int>(pattern.panels[static_cast<std::size_t>(panel)].edges.size());
    for (int edge = 0; edge < edges; ++edge) {
      counts[{panel, edge}] = segments(panel, edge);
    }
  }
  for (const SewnEdges& seam : pattern.seams) {
    const std::pair a(seam.panel_a, seam.edge_a);
    const std::pair b(seam.panel_b, seam.edge_b);
    counts[a] = counts[b] = std::max(counts[a], counts[b]);
  }
  return counts;
}

double length_of(const Points2& line) {
  const Index last = line.rows() - 1;
  return (line.bottomRows(last) - line.topRows(last)).rowwise().norm().sum();
}

// Chords are shorter than their curve: points between the ends are moved off its inner side until
// the line is as long, so that a curved edge fits a straighter one at every edge length.
Points2 as_long_as(double length, const Points2& chords) {
  const Index inner = chords.rows() - 2;
  if (inner < 1 || length_of(chords) >= length) {
    return chords;
  }
  const Points2 bends =
      chords.topRows(inner) + chords.bottomRows(inner) - 2 * chords.middleRows(1, inner);
  const auto moved = [&](double share) {
    Points2 line = chords;
    line.middleRows(1, inner) -= share * bends;
    return line;
  };
  // A circle's points need 1/12 of their bends, the first and last a little more.
  double low = 0;
  double high = 0.5;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (length_of(moved(middle)) < length ? low : high) = middle;
  }
  return moved(low);
}

Points2 sampled_outline(const Panel& panel, int panel_idx,
                        const std::map<std::pair<int, int>, int>& counts) {
  std::vector<Eigen::Vector2d> points;
  for (int edge = 0; edge < static_cast<int>(panel.edges.size()); ++edge) {
    const Points2 samples = as_long_as(edge_length(panel, edge),
                                       sample_edge(panel, edge, counts.at({panel_idx, edge})));
    for (Index i = 0; i + 1 < samples.rows(); ++i) {
      points.emplace_back(samples.row(i).transpose());
    }
  }
  Points2 outline(static_cast<Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    outline.row(static_cast<Index>(i)) = points[i].transpose();
  }
  return outline;
}

// Unsewn edges joined into closed loops: across corners, and across seams where a sewn corner is
// one point of the finished garment.
void name_openings(const SewingPattern& pattern, const EdgeVertices& edge_vertices,
                   Garment& garment) {
  std::vector<int> sewn_point(static_cast<std::size_t>(garment.mesh.vertices.rows()));
  for (std::size_t i = 0; i < sewn_point.size(); ++i) {
    sewn_point[i] = static_cast<int>(i);
  }
  const auto find = [&](int vertex) {
    while (sewn_point[static_cast<std::size_t>(vertex)] != vertex) {
      vertex = sewn_point[static_cast<std::size_t>(vertex)];
    }
    return vertex;
  };
  for (const Seam& seam : garment.seams) {
    for (std::size_t i = 0; i < seam.a.size(); ++i) {
      const int a = find(seam.a[i]);
      const int b = find(seam.b[i]);
      sewn_point[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::map<std::pair<int, int>, bool> open;  // unsewn edges not yet in a loop
  for (const auto& [key, vertices] : edge_vertices) {
    open[key] = true;
  }
  for (const SewnEdges& seam : pattern.seams) {
    open.erase({seam.panel_a, seam.edge_a});
    open.erase({seam.panel_b, seam.edge_b});
  }
  while (!open.empty()) {
    std::vector<int> loop;
    std::string name;
    auto next = open.begin();
    const int first = find(edge_vertices.at(next->first).front());
    while (next != open.end()) {
      const std::pair<int, int> key = next->first;
      open.erase(next);
      const std::vector<int>& run = edge_vertices.at(key);
      loop.insert(loop.end(), run.begin(), run.end() - 1);
      if (name.empty()) {
        name = pattern.panels[static_cast<std::size_t>(key.first)]
                   .edges[static_cast<std::size_t>(key.second)]
                   .name;
      }
      const int end = find(run.back());
      if (end == first) {
        break;
      }
      next = std::find_if(open.begin(), open.end(), [&](const auto& candidate) {
        return find(edge_vertices.at(candidate.first).front()) == end;
      });
    }
    garment.boundary_names.push_back(
        name.empty() ? "opening" + std::to_string(garment.boundary_names.size()) : name);
    garment.boundaries.push_back(std::move(loop));
  }
}

}  // namespace

OptionTable describe(PatternGarmentOptions& options) {
  OptionTable table;
  table.add("edge_length", options.edge_length, 0.002, 0.2, "m",
            "Edge length of the triangles; smaller for finer folds, larger for speed");
  return table;
}

Garment garment_from_pattern(const SewingPattern& pattern, const PatternGarmentOptions& options) {
  check_sewing_pattern(pattern);
  ATELIER_CHECK(options.edge_length >= 0.002 && options.edge_length <= 0.2,
                "edge_length is 0.002 to 0.2 m");
  const auto counts = segment_counts(pattern, options.edge_length);

  Garment garment;
  garment.name = pattern.name;
  EdgeVertices edge_vertices;
  std::vector<FlatMesh> flats;
  Index vertices = 0;
  Index faces = 0;
  for (int panel_idx = 0; panel_idx < static_cast<int>(pattern.panels.size()); ++panel_idx) {
    const Panel& panel = pattern.panels[static_cast<std::size_t>(panel_idx)];
    const Points2 outline = sampled_outline(panel, panel_idx, counts);
    try {
      flats.push_back(triangulate_outline(outline, options.edge_length));
    } catch (const DataError& error) {
      throw DataError("", "panel '" + panel.name + "' " + error.where, error.found,
                      error.expected + "; or a smaller edge length");
    }
    int at = static_cast<int>(vertices);
    const int begin = at;
    for (int edge = 0; edge < static_cast<int>(panel.edges.size()); ++edge) {
      std::vector<int>& run = edge_vertices[{panel_idx, edge}];
      for (int i = 0; i < counts.at({panel_idx, edge}); ++i) {
        run.push_back(at++);
      }
      run.push_back(at == begin + outline.rows() ? begin : at);
    }
    vertices += flats.back().vertices.rows();
    faces += flats.back().faces.rows();
    garment.panel_names.push_back(panel.name);
  }

  garment.mesh.vertices.resize(vertices, 3);
  garment.mesh.faces.resize(faces, 3);
  garment.rest.resize(vertices, 2);
  constexpr double kGap = 0.05;  // m between panels laid out side by side
  Index vertex_begin = 0;
  Index face_begin = 0;
  double x = 0;
  for (std::size_t panel = 0; panel < flats.size(); ++panel) {
    const FlatMesh& flat = flats[panel];
    const Eigen::RowVector2d low = flat.vertices.colwise().minCoeff();
    const Eigen::RowVector2d high = flat.vertices.colwise().maxCoeff();
    for (Index i = 0; i < flat.vertices.rows(); ++i) {
      garment.mesh.vertices.row(vertex_begin + i) =
          place(pattern.panels[panel].placement, flat.vertices.row(i).transpose()).transpose();
      garment.rest.row(vertex_begin + i) = flat.vertices.row(i) - low + Eigen::RowVector2d(x, 0);
    }
    garment.mesh.faces.middleRows(face_begin, flat.faces.rows()) =
        flat.faces.array() + static_cast<int>(vertex_begin);
    garment.panels.insert(garment.panels.end(), static_cast<std::size_t>(flat.faces.rows()),
                          static_cast<int>(panel));
    x += high.x() - low.x() + kGap;
    vertex_begin += flat.vertices.rows();
    face_begin += flat.faces.rows();
  }
  garment.rest_faces = garment.mesh.faces;
  garment.mesh.uvs = garment.rest / garment.rest.maxCoeff();
  garment.mesh.uv_faces = garment.rest_faces;

  for (const SewnEdges& seam : pattern.seams) {
    Seam sewn{seam.name, edge_vertices.at({seam.panel_a, seam.edge_a}),
              edge_vertices.at({seam.panel_b, seam.edge_b})};
    if (seam.reversed) {
      std::reverse(sewn.b.begin(), sewn.b.end());
    }
    garment.seams.push_back(std::move(sewn));
  }
  name_openings(pattern, edge_vertices, garment);
  return garment;
}

}  // namespace atelier
