#include "appearance/packed_atlas.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "appearance/place_shapes.h"
#include "core/error.h"
#include "core/normals.h"

namespace atelier {
namespace {

/// One chart, in metres of its surface, and where it lies in the square.
struct Chart {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300);  // of its own coordinates
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-1e300);
  double surface_area = 0;
  double flat_area = 0;
  double scale = 1;             // metres for each unit of its own coordinates
  Eigen::Vector2d place{0, 0};  // of its lower left corner in the square, on shelves
  Eigen::Vector2d size() const { return scale * (high - low); }
};

int root_of(std::vector<int>& parent, int i) {
  while (parent[static_cast<std::size_t>(i)] != i) {
    const int up = parent[static_cast<std::size_t>(i)];
    parent[static_cast<std::size_t>(i)] = parent[static_cast<std::size_t>(up)];
    i = up;
  }
  return i;
}

/// [F] the connected part of each face, numbered as they first appear.
std::vector<int> charts_of(const Triangles& uv_faces, Index count) {
  std::vector<int> parent(static_cast<std::size_t>(count));
  std::iota(parent.begin(), parent.end(), 0);
  for (Index f = 0; f < uv_faces.rows(); ++f) {
    for (int k = 1; k < 3; ++k) {
      const int a = root_of(parent, uv_faces(f, 0));
      const int b = root_of(parent, uv_faces(f, k));
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<int> number(static_cast<std::size_t>(count), -1);
  std::vector<int> chart(static_cast<std::size_t>(uv_faces.rows()));
  int next = 0;
  for (Index f = 0; f < uv_faces.rows(); ++f) {
    int& mine = number[static_cast<std::size_t>(root_of(parent, uv_faces(f, 0)))];
    mine = mine < 0 ? next++ : mine;
    chart[static_cast<std::size_t>(f)] = mine;
  }
  return chart;
}

std::vector<Chart> measured(const Mesh& mesh, const std::vector<int>& chart) {
  std::vector<Chart> charts(
      static_cast<std::size_t>(*std::max_element(chart.begin(), chart.end()) + 1));
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    Chart& mine = charts[static_cast<std::size_t>(chart[static_cast<std::size_t>(f)])];
    const Eigen::Vector2d a = mesh.uvs.row(mesh.uv_faces(f, 0));
    const Eigen::Vector2d b = mesh.uvs.row(mesh.uv_faces(f, 1));
    const Eigen::Vector2d c = mesh.uvs.row(mesh.uv_faces(f, 2));
    mine.flat_area += std::abs((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x()) / 2;
    mine.surface_area += areas[f];
    mine.low = mine.low.cwiseMin(a).cwiseMin(b).cwiseMin(c);
    mine.high = mine.high.cwiseMax(a).cwiseMax(b).cwiseMax(c);
  }
  for (std::size_t i = 0; i < charts.size(); ++i) {
    if (!(charts[i].flat_area > 0) || !(charts[i].surface_area > 0)) {
      throw DataError("", "chart " + std::to_string(i) + " of the texture coordinates", "no area",
                      "charts that cover some of the texture");
    }
    charts[i].scale = std::sqrt(charts[i].surface_area / charts[i].flat_area);
  }
  return charts;
}

/// Each chart by itself, in metres of its surface.
std::vector<FlatShape> shapes_of(const Mesh& mesh, const std::vector<int>& chart,
                                 const std::vector<Chart>& charts) {
  std::vector<FlatShape> shapes(charts.size());
  std::vector<std::vector<Index>> faces(charts.size());
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    faces[static_cast<std::size_t>(chart[static_cast<std::size_t>(f)])].push_back(f);
  }
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const auto count = static_cast<Index>(faces[i].size());
    shapes[i].points.resize(3 * count, 2);
    shapes[i].faces.resize(count, 3);
    for (Index f = 0; f < count; ++f) {
      for (int k = 0; k < 3; ++k) {
        const Index row = 3 * f + k;
        shapes[i].points.row(row) =
            charts[i].scale * mesh.uvs.row(mesh.uv_faces(faces[i][static_cast<std::size_t>(f)], k));
        shapes[i].faces(f, k) = static_cast<int>(row);
      }
    }
  }
  return shapes;
}

/// Lays charts on shelves in the unit square at `scale` units a metre; true if they fit.
bool lay(std::vector<Chart>& charts, const std::vector<std::size_t>& order, double scale,
         double margin) {
  Eigen::Vector2d corner(margin, margin);
  double shelf = 0;
  for (const std::size_t i : order) {
    const Eigen::Vector2d size = scale * charts[i].size();
    if (corner.x() + size.x() + margin > 1) {
      corner = {margin, corner.y() + shelf + margin};
      shelf = 0;
    }
    if (corner.x() + size.x() + margin > 1 || corner.y() + size.y() + margin > 1) {
      return false;
    }
    charts[i].place = corner;
    corner.x() += size.x() + margin;
    shelf = std::max(shelf, size.y());
  }
  return true;
}

}  // namespace

PackedAtlas pack_atlas(const Mesh& mesh, const PackAtlasOptions& options) {
  ATELIER_CHECK(options.resolution >= 16 && options.resolution <= 16384 && options.margin >= 1 &&
                    options.margin <= 64,
                "the atlas's options are out of range");
  check_mesh(mesh);
  if (mesh.uv_faces.rows() == 0) {
    throw DataError("", "texture coordinates", "none", "a mesh with texture coordinates");
  }
  PackedAtlas atlas;
  atlas.uv_faces = mesh.uv_faces;
  atlas.chart = charts_of(mesh.uv_faces, mesh.uvs.rows());
  std::vector<Chart> charts = measured(mesh, atlas.chart);
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].size().y() > charts[b].size().y();
  });
  const double margin = static_cast<double>(options.margin) / options.resolution;
  double low = 0;
  double high = 1;
  for (const Chart& chart : charts) {
    high = std::max(high, 1 / chart.size().maxCoeff());
  }
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (lay(charts, order, middle, margin) ? low : high) = middle;
  }
  if (!(low > 0) || !lay(charts, order, low, margin)) {
    throw DataError("", "texture coordinates", std::to_string(charts.size()) + " charts",
                    "fewer charts, or a larger texture");
  }
  std::vector<PlacedShape> placed;
  placed.reserve(charts.size());
  for (const Chart& chart : charts) {
    placed.push_back({0, chart.place - low * chart.scale * chart.low});
  }
  double scale = low;
  constexpr std::size_t kMost = 64;
  if (charts.size() <= kMost) {
    const ShapePlacement turned = place_shapes(shapes_of(mesh, atlas.chart, charts), margin, low);
    if (turned.scale > low) {
      scale = turned.scale;
      placed = turned.shapes;
    }
  }
  atlas.uvs = Points2::Zero(mesh.uvs.rows(), 2);
  for (Index f = 0; f < mesh.uv_faces.rows(); ++f) {
    const auto i = static_cast<std::size_t>(atlas.chart[static_cast<std::size_t>(f)]);
    const Eigen::Rotation2Dd turn(placed[i].angle);
    for (int k = 0; k < 3; ++k) {
      const int t = mesh.uv_faces(f, k);
      const Eigen::Vector2d own = mesh.uvs.row(t);
      atlas.uvs.row(t) = placed[i].place + scale * charts[i].scale * (turn * own);
    }
  }
  return atlas;
}

}  // namespace atelier
