#include "registration/template/texture_atlas.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/normals.h"
#include "core/topology.h"
#include "core/tree.h"
#include "registration/flattening/find_seams.h"
#include "registration/flattening/flat_pattern.h"
#include "registration/principal_stretches.h"

namespace atelier {
namespace {

/// A chart's box and where it goes.
struct Chart {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300);
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-1e300);
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  Eigen::Vector2d size() const { return high - low; }
};

/// Places charts on shelves of a given width, highest first; returns the height used.
double place_on_shelves(std::vector<Chart>& charts, double width, double gap) {
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].size().y() > charts[b].size().y();
  });
  double x = 0;
  double shelf = 0;
  double height = 0;
  for (const std::size_t i : order) {
    Chart& chart = charts[i];
    if (x > 0 && x + chart.size().x() > width) {
      shelf += height + gap;
      x = 0;
      height = 0;
    }
    chart.to = {x, shelf};
    x += chart.size().x() + gap;
    height = std::max(height, chart.size().y());
  }
  return shelf + height;
}

/// The smallest square that the shelves fit into.
double pack(std::vector<Chart>& charts, double share) {
  double widest = 0;
  double total = 0;
  for (const Chart& chart : charts) {
    widest = std::max(widest, chart.size().x());
    total += chart.size().x();
  }
  double best = std::numeric_limits<double>::infinity();
  double best_width = widest;
  constexpr int kWidths = 64;
  const auto side_of = [&](double width) {
    double side = std::max(width, widest);
    for (int round = 0; round < 3; ++round) {  // the gap is a share of the side
      side = std::max(width, place_on_shelves(charts, width, share * side));
    }
    return side;
  };
  for (int i = 0; i <= kWidths; ++i) {
    const double width = widest + (total * 1.1 - widest) * i / kWidths;
    if (const double side = side_of(width); side < best) {
      best = side;
      best_width = width;
    }
  }
  return side_of(best_width);
}

}  // namespace

OptionTable describe(TextureAtlasOptions& options) {
  OptionTable table;
  table.add("stretch", options.stretch, 0.01, 1, "",
            "Stretch below which 99% of the area must lie; lower makes more charts");
  table.add("cuts", options.cuts, 0, 1000, "",
            "Maximum number of cuts beyond those that make charts disks");
  table.add("gap", options.gap, 0, 0.1, "",
            "Gap between charts as a fraction of the side of the atlas");
  return table;
}

Mesh with_texture_atlas(const Mesh& mesh, const TextureAtlasOptions& options) {
  check_flattenable(mesh);
  const Topology topology = topology_of(mesh.faces, mesh.vertices.rows());
  FindSeamsOptions find;
  find.stretch = options.stretch;
  find.cuts = options.cuts;
  find.join = false;
  const std::vector<char> none(static_cast<std::size_t>(topology.edges.rows()), 0);
  std::vector<char> cut = find_seams(mesh, none, find).cut;
  FlattenOptions flatten;
  flatten.equal_seams = false;
  flatten.panel.even = stiffening_of(options.stretch);
  FlatPattern pattern = flatten_surface(mesh, cut, flatten);
  constexpr int kTries = 4;
  for (int i = 0; i < kTries && !pattern.overlapping.empty(); ++i) {
    FindSeamsOptions apart = find;
    apart.stretch = 1;
    apart.cuts = 40;
    apart.front_and_back = false;
    cut = find_seams(mesh, cut, apart).cut;
    pattern = flatten_surface(mesh, cut, flatten);
  }
  if (!pattern.overlapping.empty()) {
    throw DataError("", "atlas",
                    std::to_string(pattern.overlapping.size()) + " charts over themselves",
                    "a surface that can be laid flat in pieces");
  }
  std::vector<Chart> charts(static_cast<std::size_t>(pattern.cut.panel_count));
  std::vector<int> chart_of(static_cast<std::size_t>(pattern.vertices.rows()), 0);
  for (Index f = 0; f < pattern.cut.faces.rows(); ++f) {
    const int panel = pattern.cut.panels[static_cast<std::size_t>(f)];
    for (int k = 0; k < 3; ++k) {
      const int v = pattern.cut.faces(f, k);
      chart_of[static_cast<std::size_t>(v)] = panel;
      Chart& chart = charts[static_cast<std::size_t>(panel)];
      chart.low = chart.low.cwiseMin(pattern.vertices.row(v).transpose());
      chart.high = chart.high.cwiseMax(pattern.vertices.row(v).transpose());
    }
  }
  const double side = pack(charts, options.gap);
  Mesh result = mesh;
  result.uv_faces = pattern.cut.faces;
  result.uvs.resize(pattern.vertices.rows(), 2);
  for (Index v = 0; v < result.uvs.rows(); ++v) {
    const Chart& chart = charts[static_cast<std::size_t>(chart_of[static_cast<std::size_t>(v)])];
    result.uvs.row(v) =
        ((pattern.vertices.row(v).transpose() - chart.low + chart.to) / side).transpose();
  }
  return result;
}

AtlasMeasures measure_atlas(const Mesh& mesh) {
  ATELIER_CHECK(mesh.uv_faces.rows() == mesh.faces.rows() && mesh.faces.rows() > 0,
                "a mesh with texture coordinates");
  AtlasMeasures measures;
  const Index count = mesh.faces.rows();
  Points flat = Points::Zero(mesh.uvs.rows(), 3);
  flat.leftCols<2>() = mesh.uvs;
  measures.charts = 0;
  const Components pieces = connected_components(topology_of(mesh.uv_faces, mesh.uvs.rows()));
  std::vector<char> used(static_cast<std::size_t>(pieces.count), 0);
  Eigen::MatrixX2d stretches(count, 2);
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  double flat_area = 0;
  for (Index f = 0; f < count; ++f) {
    used[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])] = 1;
    const auto uv = [&](int k) -> Eigen::Vector2d {
      return mesh.uvs.row(mesh.uv_faces(f, k)).transpose();
    };
    const auto at = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices.row(mesh.faces(f, k)).transpose();
    };
    Eigen::Matrix2d square;
    square << uv(1) - uv(0), uv(2) - uv(0);
    Eigen::Matrix<double, 3, 2> curved;
    curved << at(1) - at(0), at(2) - at(0);
    const double area = square.determinant() / 2;
    flat_area += area;
    if (area <= 0) {
      ++measures.flipped;
      stretches.row(f).setConstant(1e9);
      continue;
    }
    stretches.row(f) = principal_stretches(curved * square.inverse());
  }
  for (const char one : used) {
    measures.charts += one;
  }
  measures.used = flat_area;
  const double scale = flat_area > 0 ? std::sqrt(areas.sum() / flat_area) : 1;
  std::vector<std::pair<double, double>> strains;
  for (Index f = 0; f < count; ++f) {
    const double a = stretches(f, 0) / scale;
    const double b = stretches(f, 1) / scale;
    strains.emplace_back(std::max({a, 1 / a, b, 1 / b}) - 1, areas[f]);
  }
  std::sort(strains.begin(), strains.end());
  double sum = 0;
  for (const auto& [strain, area] : strains) {
    sum += area;
    if (sum >= 0.99 * areas.sum()) {
      measures.stretch_p99 = strain;
      break;
    }
  }
  // Triangles of a plane overlap where the middle of one lies in another.
  const TriangleTree tree = build_tree(flat, mesh.uv_faces);
  for (Index f = 0; f < count; ++f) {
    const Eigen::Vector3d middle = (flat.row(mesh.uv_faces(f, 0)) + flat.row(mesh.uv_faces(f, 1)) +
                                    flat.row(mesh.uv_faces(f, 2)))
                                       .transpose() /
                                   3;
    measures.overlapping += static_cast<int>(faces_within(tree, middle, 1e-12).size()) - 1;
  }
  return measures;
}

}  // namespace atelier
