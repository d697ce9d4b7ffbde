#include "registration/flattening/flat_pattern.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "core/error.h"
#include "core/normals.h"
#include "core/parallel.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/flat_seams.h"
#include "registration/flattening/grain_direction.h"
#include "registration/principal_stretches.h"

namespace atelier {
namespace {

// Softly at first, so that the cloth beside a seam finds its place before lengths are held.
constexpr std::array kSeamWeights = {0.5, 20.0, 1e3};
constexpr double kMaxSeamWeight = 1e6;
constexpr double kEqual = 0.002;     // of a seam's length: what its two sides may differ by
constexpr double kSeamReach = 0.15;  // m

/// One panel as a surface of its own.
struct PanelSurface {
  Points vertices;
  Triangles faces;
  std::vector<int> of_cut;  ///< vertex of the cut surface
};

std::vector<PanelSurface> panel_surfaces(const Mesh& mesh, const SurfaceCut& cut) {
  std::vector<PanelSurface> panels(static_cast<std::size_t>(cut.panel_count));
  std::vector<int> local(cut.source.size(), -1);
  std::vector<Index> faces(panels.size(), 0);
  for (const int panel : cut.panels) {
    ++faces[static_cast<std::size_t>(panel)];
  }
  for (std::size_t p = 0; p < panels.size(); ++p) {
    panels[p].faces.resize(faces[p], 3);
    faces[p] = 0;
  }
  for (Index f = 0; f < cut.faces.rows(); ++f) {
    const auto p = static_cast<std::size_t>(cut.panels[static_cast<std::size_t>(f)]);
    for (int k = 0; k < 3; ++k) {
      int& place = local[static_cast<std::size_t>(cut.faces(f, k))];
      if (place < 0) {
        place = static_cast<int>(panels[p].of_cut.size());
        panels[p].of_cut.push_back(cut.faces(f, k));
      }
      panels[p].faces(faces[p], k) = place;
    }
    ++faces[p];
  }
  for (PanelSurface& panel : panels) {
    panel.vertices.resize(static_cast<Index>(panel.of_cut.size()), 3);
    for (std::size_t i = 0; i < panel.of_cut.size(); ++i) {
      panel.vertices.row(static_cast<Index>(i)) =
          mesh.vertices.row(cut.source[static_cast<std::size_t>(panel.of_cut[i])]);
    }
  }
  return panels;
}

/// Turned so that the grain is +y, its lowest corner at the origin.
Points2 along_grain(const PanelSurface& panel, const Points2& flat) {
  const Points2 turned = turned_to_grain(panel.vertices, panel.faces, flat);
  const Eigen::RowVector2d low = turned.colwise().minCoeff();
  return turned.rowwise() - low;
}

double length_of_run(const Points2& flat, const std::vector<int>& run) {
  double length = 0;
  for (std::size_t i = 1; i < run.size(); ++i) {
    length += (flat.row(run[i]) - flat.row(run[i - 1])).norm();
  }
  return length;
}

std::vector<double> edge_lengths_of(const Points2& flat, const std::vector<int>& run) {
  std::vector<double> lengths;
  for (std::size_t i = 1; i < run.size(); ++i) {
    lengths.push_back((flat.row(run[i]) - flat.row(run[i - 1])).norm());
  }
  return lengths;
}

/// Scales the edges of both sides so that the two are equally long: over `kSeamReach` to either
/// side of each edge, and exactly in all. What single edges differ by stays, as a tailor eases it
/// in: a seam that runs zigzag along triangles would strain every one of them for nothing.
void make_equal(std::vector<double>& a, std::vector<double>& b) {
  const std::vector<double> old_a = a;
  const std::vector<double> old_b = b;
  const std::size_t count = a.size();
  std::vector<double> middle(count);
  double at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double length = (old_a[i] + old_b[i]) / 2;
    middle[i] = at + length / 2;
    at += length;
  }
  double whole_a = 0;
  double whole_b = 0;
  for (std::size_t i = 0, first = 0, last = 0; i < count; ++i) {
    while (middle[i] - middle[first] > kSeamReach) {
      ++first;
    }
    while (last < count && middle[last] - middle[i] <= kSeamReach) {
      ++last;
    }
    const auto sum = [&](const std::vector<double>& lengths) {
      return std::accumulate(lengths.begin() + static_cast<std::ptrdiff_t>(first),
                             lengths.begin() + static_cast<std::ptrdiff_t>(last), 0.0);
    };
    const double half = std::sqrt(sum(old_b) / sum(old_a));
    a[i] *= half;
    b[i] /= half;
    whole_a += a[i];
    whole_b += b[i];
  }
  for (std::size_t i = 0; i < count; ++i) {
    a[i] *= (whole_a + whole_b) / (2 * whole_a);
    b[i] *= (whole_a + whole_b) / (2 * whole_b);
  }
}

/// The lengths that both sides of every seam are to have: for each panel, of its own vertices.
std::vector<std::vector<EdgeLength>> equal_lengths(const FlatPattern& pattern,
                                                   const std::vector<int>& local) {
  std::vector<std::vector<EdgeLength>> lengths(static_cast<std::size_t>(pattern.cut.panel_count));
  for (const FlatSeam& seam : pattern.seams) {
    std::vector<double> a = edge_lengths_of(pattern.vertices, seam.a);
    std::vector<double> b = edge_lengths_of(pattern.vertices, seam.b);
    make_equal(a, b);
    for (std::size_t i = 1; i < seam.a.size(); ++i) {
      const auto add = [&](int panel, const std::vector<int>& run, double length) {
        lengths[static_cast<std::size_t>(panel)].push_back(
            {local[static_cast<std::size_t>(run[i - 1])], local[static_cast<std::size_t>(run[i])],
             length});
      };
      add(seam.panel_a, seam.a, a[i - 1]);
      add(seam.panel_b, seam.b, b[i - 1]);
    }
  }
  return lengths;
}

/// The largest difference of the two sides of a seam, share of their mean length.
double worst_mismatch(const FlatPattern& pattern) {
  double worst = 0;
  for (const FlatSeam& seam : pattern.seams) {
    const double a = length_of_run(pattern.vertices, seam.a);
    const double b = length_of_run(pattern.vertices, seam.b);
    worst = std::max(worst, 2 * std::abs(a - b) / (a + b));
  }
  return worst;
}

/// Value below which `share` of the area lies.
double quantile(std::vector<std::pair<double, double>> values_areas, double share) {
  std::sort(values_areas.begin(), values_areas.end());
  double total = 0;
  for (const auto& [value, area] : values_areas) {
    total += area;
  }
  double sum = 0;
  for (const auto& [value, area] : values_areas) {
    sum += area;
    if (sum >= share * total) {
      return value;
    }
  }
  return values_areas.empty() ? 0 : values_areas.back().first;
}

}  // namespace

OptionTable describe(FlattenOptions& options) {
  OptionTable table;
  table.add("panel", describe(options.panel));
  table.add("equal_seams", options.equal_seams, "Equal length of both sides of a seam");
  return table;
}

void check_flattenable(const Mesh& mesh, const std::string& file) {
  check_mesh(mesh, file);
  if (mesh.faces.rows() == 0) {
    throw DataError(file, "mesh", "no triangle", "a surface");
  }
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  const ManifoldDefects defects = manifold_defects(topology);
  const auto refuse = [&](const std::vector<int>& places, const char* what, const char* found,
                          const char* expected) {
    if (!places.empty()) {
      throw DataError(file, what + (" " + std::to_string(places.front())),
                      std::to_string(places.size()) + found, expected);
    }
  };
  refuse(defects.degenerate_faces, "triangle", " triangles with a vertex twice",
         "three different vertices");
  refuse(defects.duplicate_faces, "triangle", " triangles that are there twice", "each once");
  if (!defects.non_manifold_edges.empty()) {
    const int edge = defects.non_manifold_edges.front();
    throw DataError(
        file,
        "edge of vertices " + std::to_string(topology.edges(edge, 0)) + " and " +
            std::to_string(topology.edges(edge, 1)),
        std::to_string(defects.non_manifold_edges.size()) + " edges of three triangles or more",
        "a surface of one layer, with at most two at an edge");
  }
  refuse(defects.inconsistent_edges, "edge", " edges between triangles of opposite orientation",
         "triangles counter-clockwise from outside");
}

FlatPattern flatten_surface(const Mesh& mesh, const std::vector<char>& cut,
                            const FlattenOptions& options, const Points2& start) {
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  FlatPattern pattern;
  pattern.cut = cut_surface(topology, cut);
  pattern.seams = flat_seams(topology, cut, pattern.cut);
  pattern.vertices = Points2::Zero(static_cast<Index>(pattern.cut.source.size()), 2);
  const std::vector<PanelSurface> panels = panel_surfaces(mesh, pattern.cut);
  std::vector<int> local(pattern.cut.source.size());
  for (const PanelSurface& panel : panels) {
    for (std::size_t i = 0; i < panel.of_cut.size(); ++i) {
      local[static_cast<std::size_t>(panel.of_cut[i])] = static_cast<int>(i);
    }
  }
  std::vector<FlatPanel> flat(panels.size());
  ATELIER_CHECK(start.rows() == 0 || start.rows() == pattern.vertices.rows(),
                "a start of the same cut");
  for (std::size_t p = 0; p < panels.size() && start.rows() > 0; ++p) {
    Points2& first = flat[p].vertices;
    first.resize(panels[p].vertices.rows(), 2);
    for (std::size_t i = 0; i < panels[p].of_cut.size(); ++i) {
      first.row(static_cast<Index>(i)) = start.row(panels[p].of_cut[i]);
    }
    if (turned_faces(first, panels[p].faces) > 0) {
      first.resize(0, 2);
    }
  }
  const auto lay = [&](const FlattenPanelOptions& how,
                       const std::vector<std::vector<EdgeLength>>& lengths) {
    parallel_for(static_cast<Index>(panels.size()), 1, [&](Index begin, Index end) {
      for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p) {
        try {
          flat[p] = flatten_panel(panels[p].vertices, panels[p].faces, how,
                                  lengths.empty() ? std::vector<EdgeLength>{} : lengths[p],
                                  flat[p].vertices);
        } catch (const DataError& error) {
          throw DataError(error.file, "panel " + std::to_string(p) + ", " + error.where,
                          error.found, error.expected);
        }
      }
    });
    for (std::size_t p = 0; p < panels.size(); ++p) {
      for (std::size_t i = 0; i < panels[p].of_cut.size(); ++i) {
        pattern.vertices.row(panels[p].of_cut[i]) = flat[p].vertices.row(static_cast<Index>(i));
      }
    }
  };
  lay(options.panel, {});
  if (options.equal_seams && !pattern.seams.empty()) {
    FlattenPanelOptions held = options.panel;
    for (const double weight : kSeamWeights) {
      held.length_weight = weight;
      lay(held, equal_lengths(pattern, local));
    }
    // Where much is stretched, it takes more to hold a length.
    while (worst_mismatch(pattern) > kEqual && held.length_weight < kMaxSeamWeight) {
      held.length_weight *= 10;
      lay(held, equal_lengths(pattern, local));
    }
  }
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const Points2 turned = along_grain(panels[p], flat[p].vertices);
    for (std::size_t i = 0; i < panels[p].of_cut.size(); ++i) {
      pattern.vertices.row(panels[p].of_cut[i]) = turned.row(static_cast<Index>(i));
    }
    pattern.panel_names.push_back("panel" + std::to_string(p + 1));
    // Judged last, of the places that are returned: whatever moved them.
    if (lies_over_itself(turned, panels[p].faces)) {
      pattern.overlapping.push_back(static_cast<int>(p));
    }
    if (!flat[p].converged) {
      pattern.not_converged.push_back(static_cast<int>(p));
    }
  }
  return pattern;
}

FlatMeasures measure_flat(const Mesh& mesh, const FlatPattern& pattern) {
  FlatMeasures measures;
  const Index faces = mesh.faces.rows();
  ATELIER_CHECK(pattern.cut.faces.rows() == faces, "the pattern of this mesh");
  measures.stretches.resize(faces, 2);
  measures.strain.resize(faces);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  std::vector<std::pair<double, double>> strain_areas;
  std::vector<std::pair<double, double>> thread_areas;
  double flat_area = 0;
  for (Index f = 0; f < faces; ++f) {
    const Eigen::Vector2d a = pattern.vertices.row(pattern.cut.faces(f, 0));
    const Eigen::Vector2d ab = pattern.vertices.row(pattern.cut.faces(f, 1)).transpose() - a;
    const Eigen::Vector2d ac = pattern.vertices.row(pattern.cut.faces(f, 2)).transpose() - a;
    const double area = (ab.x() * ac.y() - ab.y() * ac.x()) / 2;
    flat_area += area;
    const auto to_curved =
        face_deformation(mesh.vertices, mesh.faces, pattern.vertices, pattern.cut.faces, f);
    measures.stretches.row(f) = principal_stretches(to_curved);
    measures.strain[f] = (measures.stretches.row(f).array() - 1).abs().maxCoeff();
    strain_areas.emplace_back(measures.strain[f], areas[f]);
    const auto threads = (to_curved.colwise().norm().array() - 1).abs().eval();
    thread_areas.emplace_back(threads.maxCoeff(), areas[f]);
  }
  measures.inverted = turned_faces(pattern.vertices, pattern.cut.faces);
  measures.strain_p50 = quantile(strain_areas, 0.5);
  measures.strain_p95 = quantile(strain_areas, 0.95);
  measures.strain_p99 = quantile(strain_areas, 0.99);
  measures.thread_p99 = quantile(thread_areas, 0.99);
  measures.strain_max = measures.strain.maxCoeff();
  measures.area_ratio = flat_area / areas.sum();
  measures.seam_mismatch = worst_mismatch(pattern);
  for (const FlatSeam& seam : pattern.seams) {
    measures.seam_length +=
        (length_of_run(pattern.vertices, seam.a) + length_of_run(pattern.vertices, seam.b)) / 2;
  }
  measures.overlaps = static_cast<int>(pattern.overlapping.size());
  return measures;
}

Garment garment_of(const Mesh& mesh, const FlatPattern& pattern) {
  constexpr double kGap = 0.05;  // m between panels
  Garment garment;
  garment.mesh = mesh;
  garment.rest = pattern.vertices;
  garment.rest_faces = pattern.cut.faces;
  garment.panels = pattern.cut.panels;
  garment.panel_names = pattern.panel_names;
  std::vector<int> panel_of(pattern.cut.source.size());
  for (Index f = 0; f < pattern.cut.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      panel_of[static_cast<std::size_t>(pattern.cut.faces(f, k))] =
          pattern.cut.panels[static_cast<std::size_t>(f)];
    }
  }
  std::vector<double> widths(static_cast<std::size_t>(pattern.cut.panel_count), 0);
  for (std::size_t v = 0; v < panel_of.size(); ++v) {
    double& width = widths[static_cast<std::size_t>(panel_of[v])];
    width = std::max(width, pattern.vertices(static_cast<Index>(v), 0));
  }
  std::vector<double> left(widths.size(), 0);
  for (std::size_t p = 1; p < widths.size(); ++p) {
    left[p] = left[p - 1] + widths[p - 1] + kGap;
  }
  for (std::size_t v = 0; v < panel_of.size(); ++v) {
    garment.rest(static_cast<Index>(v), 0) += left[static_cast<std::size_t>(panel_of[v])];
  }
  garment.mesh.uvs = garment.rest / std::max(garment.rest.maxCoeff(), 1e-12);
  garment.mesh.uv_faces = garment.rest_faces;
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  garment.boundaries = boundary_loops(topology);
  for (std::size_t i = 0; i < garment.boundaries.size(); ++i) {
    garment.boundary_names.push_back("opening" + std::to_string(i));
  }
  return garment;
}

}  // namespace atelier
