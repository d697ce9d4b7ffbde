#include "registration/template/surface_through_points.h"

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

using Cell = Eigen::Vector3i;

constexpr double kThickness = 2.5;  // cells on either side of the surface
constexpr double kSpread = 0.25;    // and so much more for each metre away from the points
constexpr double kGradientWeight = 0.3;
constexpr double kMaxCells = 268435456.0;

/// Nodes of a box of cells, of which some have unknowns.
struct Grid {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  double cell = 0;
  Cell size = Cell::Zero();
  std::vector<int> unknown;   // of each node of the box, -1: none
  std::vector<Cell> nodes;    // of each unknown
  std::vector<double> start;  // its first value, in cells

  std::size_t at(const Cell& node) const {
    return (static_cast<std::size_t>(node.z()) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(node.y())) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(node.x());
  }
  /// -1 outside of the box too.
  int unknown_at(const Cell& node) const {
    return (node.array() < 0).any() || (node.array() >= size.array()).any() ? -1
                                                                            : unknown[at(node)];
  }
  Eigen::Vector3d position(const Cell& node) const { return low + cell * node.cast<double>(); }
};

Cell corner_of(int corner) {
  return {corner & 1, (corner >> 1) & 1, (corner >> 2) & 1};
}

Grid grid_near(const Points& points, const Points& normals, const ThroughPointsOptions& options) {
  Grid grid;
  grid.cell = options.cell;
  const int margin = saturating_cast<int>(std::ceil(options.reach / options.cell) + 2);
  grid.low =
      points.colwise().minCoeff().transpose() - Eigen::Vector3d::Constant(margin * options.cell);
  const Eigen::Vector3d extent = points.colwise().maxCoeff().transpose() - grid.low;
  const Eigen::Vector3d count = (extent / options.cell).array().ceil() + margin + 1;
  if (!(count.prod() <= kMaxCells)) {  // sides fit: each is at least 1
    throw DataError("", "cell", short_number(options.cell) + " m",
                    "larger cells for points that lie so far apart");
  }
  grid.size = count.cast<int>();  // and so do the places of points, which lie in the grid
  std::vector<float> nearest(static_cast<std::size_t>(count.prod()),
                             std::numeric_limits<float>::infinity());
  std::vector<float> value(nearest.size(), 0);
  for (Index p = 0; p < points.rows(); ++p) {
    const Eigen::Vector3d point = points.row(p).transpose();
    const Eigen::Vector3d normal = normals.row(p).transpose();
    const Cell middle = ((point - grid.low) / grid.cell).array().round().cast<int>();
    const Cell first = (middle.array() - margin + 1).max(0);
    const Cell last = (middle.array() + margin - 1).min(grid.size.array() - 1);
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          const Eigen::Vector3d away = grid.position({x, y, z}) - point;
          const double distance = away.norm();
          const double height = away.dot(normal);
          if (distance > options.reach + kThickness * grid.cell ||
              std::abs(height) > kThickness * grid.cell + kSpread * distance) {
            continue;
          }
          const std::size_t at = grid.at({x, y, z});
          if (static_cast<float>(distance) < nearest[at]) {
            nearest[at] = static_cast<float>(distance);
            value[at] = static_cast<float>(height / grid.cell);
          }
        }
      }
    }
  }
  grid.unknown.assign(nearest.size(), -1);
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        const std::size_t at = grid.at({x, y, z});
        if (std::isfinite(nearest[at])) {
          grid.unknown[at] = static_cast<int>(grid.nodes.size());
          grid.nodes.emplace_back(x, y, z);
          grid.start.push_back(value[at]);
        }
      }
    }
  }
  return grid;
}

/// Rows of a least squares problem.
struct Rows {
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> right;

  void begin(double value) { right.push_back(value); }
  void add(int unknown, double value) {
    entries.emplace_back(static_cast<int>(right.size()) - 1, unknown, value);
  }
};

/// The value of the field at a point is 0, its gradient the normal.
void add_point(Rows& rows, const Grid& grid, const Eigen::Vector3d& point,
               const Eigen::Vector3d& normal, double weight) {
  const Eigen::Vector3d place = (point - grid.low) / grid.cell;
  const Cell base = place.array().floor().cast<int>();
  const Eigen::Vector3d t = place - base.cast<double>();
  std::array<int, 8> unknown{};
  for (int c = 0; c < 8; ++c) {
    unknown[static_cast<std::size_t>(c)] = grid.unknown_at(base + corner_of(c));
    if (unknown[static_cast<std::size_t>(c)] < 0) {
      return;
    }
  }
  const auto part = [&](int corner, int axis) {
    return ((corner >> axis) & 1) != 0 ? t[axis] : 1 - t[axis];
  };
  const double value_weight = std::sqrt(weight);
  rows.begin(0);
  for (int c = 0; c < 8; ++c) {
    rows.add(unknown[static_cast<std::size_t>(c)],
             value_weight * part(c, 0) * part(c, 1) * part(c, 2));
  }
  const double gradient_weight = std::sqrt(weight * kGradientWeight);
  for (int axis = 0; axis < 3; ++axis) {
    rows.begin(gradient_weight * normal[axis]);
    for (int c = 0; c < 8; ++c) {
      const double sign = ((c >> axis) & 1) != 0 ? 1 : -1;
      rows.add(unknown[static_cast<std::size_t>(c)],
               gradient_weight * sign * part(c, (axis + 1) % 3) * part(c, (axis + 2) % 3));
    }
  }
}

/// Second differences at a node vanish.
void add_bending(Rows& rows, const Grid& grid, const Cell& node, double weight) {
  const int middle = grid.unknown_at(node);
  for (int axis = 0; axis < 3; ++axis) {
    const int before = grid.unknown_at(node - Cell::Unit(axis));
    const int after = grid.unknown_at(node + Cell::Unit(axis));
    if (before >= 0 && after >= 0) {
      rows.begin(0);
      rows.add(before, weight);
      rows.add(middle, -2 * weight);
      rows.add(after, weight);
    }
    const int next = (axis + 1) % 3;
    const int there = grid.unknown_at(node + Cell::Unit(next));
    const int both = grid.unknown_at(node + Cell::Unit(axis) + Cell::Unit(next));
    if (after >= 0 && there >= 0 && both >= 0) {
      const double mixed = weight * std::sqrt(2.0);
      rows.begin(0);
      rows.add(middle, mixed);
      rows.add(after, -mixed);
      rows.add(there, -mixed);
      rows.add(both, mixed);
    }
  }
}

Eigen::VectorXd solve(const Grid& grid, const Points& points, const Points& normals,
                      const Eigen::VectorXd& weights, const ThroughPointsOptions& options) {
  Rows rows;
  for (Index p = 0; p < points.rows(); ++p) {
    add_point(rows, grid, points.row(p).transpose(), normals.row(p).transpose(), weights[p]);
  }
  for (const Cell& node : grid.nodes) {
    add_bending(rows, grid, node, std::sqrt(options.stiffness));
  }
  const auto unknowns = static_cast<Index>(grid.nodes.size());
  Eigen::SparseMatrix<double> system(static_cast<Index>(rows.right.size()), unknowns);
  system.setFromTriplets(rows.entries.begin(), rows.entries.end());
  Eigen::LeastSquaresConjugateGradient<Eigen::SparseMatrix<double>> solver;
  solver.setMaxIterations(options.iterations);
  solver.setTolerance(1e-5);
  solver.compute(system);
  return solver.solveWithGuess(
      Eigen::Map<const Eigen::VectorXd>(rows.right.data(), static_cast<Index>(rows.right.size())),
      Eigen::Map<const Eigen::VectorXd>(grid.start.data(), unknowns));
}

/// Vertices on edges between unknowns, each made once.
class Polygons {
 public:
  Polygons(const Grid& grid, const Eigen::VectorXd& field) : grid_(grid), field_(field) {}

  /// The triangles of one tetrahedron; corners are unknowns.
  void add(const std::array<int, 4>& corners) {
    std::array<int, 4> inside{};
    std::array<int, 4> outside{};
    std::size_t in = 0;
    std::size_t out = 0;
    for (const int corner : corners) {
      if (field_[corner] < 0) {
        inside[in++] = corner;
      } else {
        outside[out++] = corner;
      }
    }
    if (in == 0 || out == 0) {
      return;
    }
    const Eigen::Vector3d outwards = mean(outside, out) - mean(inside, in);
    if (in == 1 || out == 1) {
      const int one = in == 1 ? inside[0] : outside[0];
      const std::array<int, 4>& three = in == 1 ? outside : inside;
      triangle(vertex(one, three[0]), vertex(one, three[1]), vertex(one, three[2]), outwards);
      return;
    }
    const int a = vertex(inside[0], outside[0]);
    const int b = vertex(inside[0], outside[1]);
    const int c = vertex(inside[1], outside[1]);
    const int d = vertex(inside[1], outside[0]);
    triangle(a, b, c, outwards);
    triangle(a, c, d, outwards);
  }

  Mesh mesh() const {
    Mesh mesh;
    mesh.vertices.resize(static_cast<Index>(vertices_.size()), 3);
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      mesh.vertices.row(static_cast<Index>(v)) = vertices_[v].transpose();
    }
    mesh.faces.resize(static_cast<Index>(faces_.size()), 3);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      mesh.faces.row(static_cast<Index>(f)) << faces_[f][0], faces_[f][1], faces_[f][2];
    }
    return mesh;
  }

 private:
  Eigen::Vector3d position(int unknown) const {
    return grid_.position(grid_.nodes[static_cast<std::size_t>(unknown)]);
  }
  Eigen::Vector3d mean(const std::array<int, 4>& corners, std::size_t count) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      sum += position(corners[i]);
    }
    return sum / static_cast<double>(count);
  }
  int vertex(int one, int other) {
    const std::pair<int, int> edge = std::minmax(one, other);
    const auto [found, fresh] = on_edge_.try_emplace(edge, static_cast<int>(vertices_.size()));
    if (fresh) {
      const double a = field_[edge.first];
      const double b = field_[edge.second];
      constexpr double kOffCorner = 0.02;  // no triangle without area where the field is 0
      const double t = std::clamp(a / (a - b), kOffCorner, 1 - kOffCorner);
      vertices_.emplace_back((1 - t) * position(edge.first) + t * position(edge.second));
    }
    return found->second;
  }
  void triangle(int a, int b, int c, const Eigen::Vector3d& outwards) {
    const auto at = [&](int v) { return vertices_[static_cast<std::size_t>(v)]; };
    if ((at(b) - at(a)).cross(at(c) - at(a)).dot(outwards) < 0) {
      std::swap(b, c);
    }
    faces_.push_back({a, b, c});
  }

  const Grid& grid_;
  const Eigen::VectorXd& field_;
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<int, 3>> faces_;
  std::map<std::pair<int, int>, int> on_edge_;
};

/// Six tetrahedra round a cell's diagonal; neighbouring cells agree on the faces between them.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

Mesh polygonised(const Grid& grid, const Eigen::VectorXd& field) {
  Polygons polygons(grid, field);
  for (const Cell& node : grid.nodes) {
    std::array<int, 8> corners{};
    bool whole = true;
    int below = 0;
    for (int c = 0; c < 8; ++c) {
      const int unknown = grid.unknown_at(node + corner_of(c));
      corners[static_cast<std::size_t>(c)] = unknown;
      whole = whole && unknown >= 0;
      below += whole && field[unknown] < 0 ? 1 : 0;
    }
    if (!whole || below == 0 || below == 8) {
      continue;
    }
    for (const std::array<int, 4>& tetrahedron : kTetrahedra) {
      std::array<int, 4> four{};
      for (std::size_t i = 0; i < 4; ++i) {
        four[i] = corners[static_cast<std::size_t>(tetrahedron[i])];
      }
      polygons.add(four);
    }
  }
  return polygons.mesh();
}

}  // namespace

OptionTable describe(ThroughPointsOptions& options) {
  OptionTable table;
  table.add("cell", options.cell, 1e-4, 1, "m", "Cell size of the grid; smaller keeps finer folds");
  table.add("reach", options.reach, 0, 1, "m", "Half the width of the largest hole that is closed");
  table.add("stiffness", options.stiffness, 1e-6, 1e3, "",
            "Stiffness of the surface where there are no points, relative to the points; larger is "
            "smoother");
  table.add("iterations", options.iterations, 1, 10000, "", "Number of solver iterations");
  return table;
}

Mesh surface_through_points(const Points& points, const Points& normals,
                            const Eigen::VectorXd& weights, const ThroughPointsOptions& options) {
  ATELIER_CHECK(points.rows() == normals.rows() && points.rows() == weights.size(),
                "a normal and a weight for each point");
  ATELIER_CHECK(points.allFinite() && normals.allFinite() && weights.allFinite(),
                "finite points, normals and weights");
  ATELIER_CHECK(options.cell > 0 && options.reach >= 0 && options.stiffness > 0,
                "a cell and a stiffness above 0");
  if (points.rows() == 0) {
    return {};
  }
  const Grid grid = grid_near(points, normals, options);
  return polygonised(grid, solve(grid, points, normals, weights, options));
}

}  // namespace atelier
