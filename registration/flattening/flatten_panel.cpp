#include "registration/flattening/flatten_panel.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/cross.h"
#include "core/error.h"
#include "core/topology.h"
#include "registration/flattening/flat_overlaps.h"
#include "registration/flattening/needless_triangles.h"
#include "registration/flattening/panel_energy.h"
#include "registration/flattening/woven_shape.h"

namespace atelier {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

void check_face_shapes(const Points& vertices, const Triangles& faces) {
  if (!vertices.allFinite()) {
    throw DataError("", "vertices", "a number that is not finite", "finite metres");
  }
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = vertices.row(faces(f, 0));
    const Eigen::Vector3d b = vertices.row(faces(f, 1));
    const Eigen::Vector3d c = vertices.row(faces(f, 2));
    if (is_without_area(a, b, c)) {
      throw DataError("", "triangle " + std::to_string(f), "no area",
                      "triangles with an area; a remesher removes those without");
    }
  }
}

/// The one boundary loop of a disk, counter-clockwise.
std::vector<int> disc_boundary(const Triangles& faces, Index vertex_count) {
  if (faces.rows() == 0) {
    throw DataError("", "panel", "no triangle", "a surface");
  }
  const Topology topology = topology_of(faces, vertex_count);
  const ManifoldDefects defects = manifold_defects(topology);
  if (!is_manifold(defects)) {
    const std::vector<Finding> findings = findings_of(defects, topology);
    throw DataError("", "panel", findings.empty() ? "no manifold" : to_string(findings.front()),
                    "an oriented surface with at most two triangles at an edge");
  }
  if (!defects.isolated_vertices.empty()) {
    throw DataError("", "vertex " + std::to_string(defects.isolated_vertices.front()),
                    "in no triangle", "vertices of the panel alone");
  }
  const int pieces = connected_components(topology).count;
  if (pieces != 1) {
    throw DataError("", "panel", std::to_string(pieces) + " pieces", "one");
  }
  std::vector<std::vector<int>> loops = boundary_loops(topology);
  if (loops.empty()) {
    throw DataError("", "panel", "a closed surface", "one with a boundary: cut it open");
  }
  if (loops.size() != 1 || euler_characteristic(topology) != 1) {
    throw DataError("", "panel", std::to_string(loops.size()) + " boundary loops",
                    "a disk, with one: cut it open");
  }
  return std::move(loops.front());
}

Points2 as_points(const Eigen::VectorXd& x) {
  return Eigen::Map<const Points2>(x.data(), x.size() / 2, 2);
}

Eigen::VectorXd as_vector(const Points2& points) {
  return Eigen::Map<const Eigen::VectorXd>(points.data(), points.size());
}

double flat_area(const Points2& flat, const Triangles& faces, Index f) {
  const Eigen::Vector2d a = flat.row(faces(f, 0));
  return cross(flat.row(faces(f, 1)).transpose() - a, flat.row(faces(f, 2)).transpose() - a) / 2;
}

bool nothing_turned(const Points2& flat, const Triangles& faces) {
  if (!flat.allFinite()) {
    return false;
  }
  for (Index f = 0; f < faces.rows(); ++f) {
    if (!(flat_area(flat, faces, f) > 0)) {
      return false;
    }
  }
  return true;
}

/// True if the outline turns by 2 pi in all: where no face is turned over, the map then has no
/// branch point.
bool turns_once(const Points2& flat, const std::vector<int>& boundary) {
  double turning = 0;
  const std::size_t count = boundary.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d in = flat.row(boundary[i]) - flat.row(boundary[(i + count - 1) % count]);
    const Eigen::Vector2d out = flat.row(boundary[(i + 1) % count]) - flat.row(boundary[i]);
    turning += std::atan2(cross(in, out), in.dot(out));
  }
  return std::abs(turning - 2 * std::numbers::pi) < 0.1;
}

double surface_area(const Points& vertices, const Triangles& faces) {
  double area = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = vertices.row(faces(f, 0));
    area += (vertices.row(faces(f, 1)).transpose() - a)
                .cross(vertices.row(faces(f, 2)).transpose() - a)
                .norm() /
            2;
  }
  return area;
}

/// Scaled so that its area is the surface's.
Points2 scaled_to(double area, const Points2& flat, const Triangles& faces) {
  double now = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    now += flat_area(flat, faces, f);
  }
  return now > 0 ? Points2(flat * std::sqrt(area / now)) : flat;
}

/// Least squares conformal map; two far boundary vertices are held.
Points2 conformal_map(const Points& vertices, const Triangles& faces,
                      const std::vector<int>& boundary) {
  const int held0 = boundary.front();
  int held1 = boundary[boundary.size() / 2];
  for (const int v : boundary) {
    if ((vertices.row(v) - vertices.row(held0)).norm() >
        (vertices.row(held1) - vertices.row(held0)).norm()) {
      held1 = v;
    }
  }
  // Conformal energy: half the Dirichlet energy minus the area, a quadratic form in x and y.
  const int n = static_cast<int>(vertices.rows());
  std::vector<Eigen::Triplet<double>> entries;
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int i = faces(f, (k + 1) % 3);
      const int j = faces(f, (k + 2) % 3);
      const Eigen::Vector3d a = vertices.row(i) - vertices.row(faces(f, k));
      const Eigen::Vector3d b = vertices.row(j) - vertices.row(faces(f, k));
      const double cotangent = a.dot(b) / a.cross(b).norm() / 2;
      for (int d = 0; d < 2; ++d) {
        entries.emplace_back(2 * i + d, 2 * i + d, cotangent);
        entries.emplace_back(2 * j + d, 2 * j + d, cotangent);
        entries.emplace_back(2 * i + d, 2 * j + d, -cotangent);
        entries.emplace_back(2 * j + d, 2 * i + d, -cotangent);
      }
      // The area of (origin, i, j), as a symmetric form.
      entries.emplace_back(2 * i, 2 * j + 1, -0.5);
      entries.emplace_back(2 * j + 1, 2 * i, -0.5);
      entries.emplace_back(2 * i + 1, 2 * j, 0.5);
      entries.emplace_back(2 * j, 2 * i + 1, 0.5);
    }
  }
  Sparse energy(2 * n, 2 * n);
  energy.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(2 * n);
  x[2 * held1] = (vertices.row(held1) - vertices.row(held0)).norm();
  const Eigen::VectorXd pull = energy * x;
  std::vector<int> row(static_cast<std::size_t>(2 * n), -1);
  int rows = 0;
  for (int i = 0; i < 2 * n; ++i) {
    if (i / 2 != held0 && i / 2 != held1) {
      row[static_cast<std::size_t>(i)] = rows++;
    }
  }
  std::vector<Eigen::Triplet<double>> free;
  for (int column = 0; column < 2 * n; ++column) {
    for (Sparse::InnerIterator at(energy, column); at; ++at) {
      const int r = row[static_cast<std::size_t>(at.row())];
      const int c = row[static_cast<std::size_t>(column)];
      if (r >= 0 && c >= 0) {
        free.emplace_back(r, c, at.value());
      }
    }
  }
  Sparse system(rows, rows);
  system.setFromTriplets(free.begin(), free.end());
  Eigen::VectorXd right(rows);
  for (int i = 0; i < 2 * n; ++i) {
    if (row[static_cast<std::size_t>(i)] >= 0) {
      right[row[static_cast<std::size_t>(i)]] = -pull[i];
    }
  }
  const Eigen::SimplicialLDLT<Sparse> solver(system);
  if (solver.info() != Eigen::Success) {
    return {};
  }
  const Eigen::VectorXd solution = solver.solve(right);
  for (int i = 0; i < 2 * n; ++i) {
    if (row[static_cast<std::size_t>(i)] >= 0) {
      x[i] = solution[row[static_cast<std::size_t>(i)]];
    }
  }
  return as_points(x);
}

/// Tutte's embedding: the boundary on a circle, by arc length, every inner vertex a mean of its
/// neighbours, weighted by mean value coordinates or evenly.
Points2 tutte_embedding(const Points& vertices, const Triangles& faces,
                        const std::vector<int>& boundary, bool even_weights) {
  const int n = static_cast<int>(vertices.rows());
  Points2 flat = Points2::Zero(n, 2);
  std::vector<char> fixed(static_cast<std::size_t>(n), 0);
  double length = 0;
  const auto step = [&](std::size_t i) {
    return (vertices.row(boundary[(i + 1) % boundary.size()]) - vertices.row(boundary[i])).norm();
  };
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    length += step(i);
  }
  double at = 0;
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    const double angle = 2 * std::numbers::pi * at / length;
    flat.row(boundary[i]) << std::cos(angle), std::sin(angle);
    fixed[static_cast<std::size_t>(boundary[i])] = 1;
    at += step(i);
  }
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(n);
  Points2 right = Points2::Zero(n, 2);
  const auto weigh = [&](int i, int j, double weight) {
    if (fixed[static_cast<std::size_t>(i)] != 0) {
      return;
    }
    sums[i] += weight;
    if (fixed[static_cast<std::size_t>(j)] != 0) {
      right.row(i) += weight * flat.row(j);
    } else {
      entries.emplace_back(i, j, -weight);
    }
  };
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int i = faces(f, k);
      const int j = faces(f, (k + 1) % 3);
      const int l = faces(f, (k + 2) % 3);
      const Eigen::Vector3d a = vertices.row(j) - vertices.row(i);
      const Eigen::Vector3d b = vertices.row(l) - vertices.row(i);
      const double half = std::atan2(a.cross(b).norm(), a.dot(b)) / 2;
      weigh(i, j, even_weights ? 1 : std::tan(half) / a.norm());
      weigh(i, l, even_weights ? 1 : std::tan(half) / b.norm());
    }
  }
  for (int i = 0; i < n; ++i) {
    entries.emplace_back(i, i, fixed[static_cast<std::size_t>(i)] != 0 ? 1 : sums[i]);
    if (fixed[static_cast<std::size_t>(i)] != 0) {
      right.row(i) = flat.row(i);
    }
  }
  Sparse system(n, n);
  system.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Sparse> solver(system);
  if (solver.info() != Eigen::Success) {
    return {};
  }
  Points2 solved(n, 2);
  for (int d = 0; d < 2; ++d) {
    const Eigen::VectorXd column = solver.solve(Eigen::VectorXd(right.col(d)));
    solved.col(d) = column;  // SparseLU cannot solve into a column of a row-major matrix
  }
  return solved;
}

Points2 first_map(const Points& vertices, const Triangles& faces,
                  const std::vector<int>& boundary) {
  const double area = surface_area(vertices, faces);
  const auto fits = [&](const Points2& flat) {
    return flat.rows() == vertices.rows() && nothing_turned(flat, faces);
  };
  Points2 flat = conformal_map(vertices, faces, boundary);
  if (fits(flat) && turns_once(flat, boundary)) {
    return scaled_to(area, flat, faces);
  }
  for (const bool even : {false, true}) {
    flat = tutte_embedding(vertices, faces, boundary, even);
    if (fits(flat)) {
      return scaled_to(area, flat, faces);
    }
  }
  throw DataError("", "panel", "triangles too uneven to be laid flat without turning one over",
                  "a surface with more isotropic triangles");
}

}  // namespace

OptionTable describe(FlattenPanelOptions& options) {
  OptionTable table;
  table.add("iterations", options.iterations, 1, 10000, "",
            "Maximum number of Newton steps for a panel");
  table.add("tolerance", options.tolerance, 0, 0.1, "",
            "Relative decrease of the energy below which a panel has converged");
  table.add("even", options.even, 0, 1, "",
            "Stretch beyond which the energy stiffens, which spreads stretch over the panel; 0: "
            "never. Found seams use half their own stretch");
  table.add("length_weight", options.length_weight, 0, 1e9, "",
            "Weight of the prescribed lengths of seam edges");
  return table;
}

FlatPanel flatten_panel(const Points& vertices, const Triangles& faces,
                        const FlattenPanelOptions& options, const std::vector<EdgeLength>& lengths,
                        const Points2& start) {
  ATELIER_CHECK(options.iterations >= 1 && options.tolerance >= 0 && options.even >= 0,
                "flatten options out of range");
  const std::vector<int> boundary = disc_boundary(faces, vertices.rows());
  check_face_shapes(vertices, faces);
  for (const EdgeLength& edge : lengths) {
    ATELIER_CHECK(edge.a >= 0 && edge.b >= 0 && edge.a < vertices.rows() &&
                      edge.b < vertices.rows() && edge.a != edge.b && edge.length > 0,
                  "a length of no edge");
  }
  ATELIER_CHECK(
      start.rows() == 0 || (start.rows() == vertices.rows() && nothing_turned(start, faces)),
      "the start turns a face over");
  FlatPanel flat;
  Eigen::VectorXd x = as_vector(start.rows() > 0 ? start : first_map(vertices, faces, boundary));
  const bool goes_on = options.woven && start.rows() > 0;
  PanelEnergy energy(vertices, faces, lengths, options.length_weight, options.even);
  Eigen::SimplicialLDLT<Sparse> solver;
  double now = energy.value(x);
  flat.converged = goes_on;
  for (; flat.iterations < options.iterations && !flat.converged; ++flat.iterations) {
    const Eigen::VectorXd gradient = energy.gradient(x);
    const Sparse& hessian = energy.hessian(x);
    if (flat.iterations == 0) {
      solver.analyzePattern(hessian);
    }
    solver.factorize(hessian);
    if (solver.info() != Eigen::Success) {
      break;
    }
    const Eigen::VectorXd step = -solver.solve(gradient);
    const double slope = gradient.dot(step);
    if (!step.allFinite() || !(slope < 0)) {
      flat.converged = step.allFinite() && std::abs(slope) <= 1e-12 * now;
      break;
    }
    double share = energy.longest_step(x, step);
    double next = energy.value(x + share * step);
    for (int halving = 0; halving < 50 && !(next <= now + 1e-4 * share * slope); ++halving) {
      share /= 2;
      next = energy.value(x + share * step);
    }
    if (!(next < now)) {
      flat.converged = true;  // as flat as numbers can tell
      break;
    }
    x += share * step;
    flat.converged = now - next <= options.tolerance * now;
    now = next;
  }
  flat.energy = energy.stretching(x);
  flat.vertices = as_points(x);
  if (options.woven) {
    WovenShapeOptions how;
    how.even = options.even > 0 ? options.even : how.even;
    how.length_weight = options.length_weight;
    how.iterations = std::min(how.iterations, options.iterations);
    how.still = std::max(how.still, options.tolerance);
    flat.vertices = woven_shape(vertices, faces, flat.vertices, how, lengths);
  }
  Points2 loop(static_cast<Index>(boundary.size()), 2);
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    loop.row(static_cast<Index>(i)) = flat.vertices.row(boundary[i]);
  }
  flat.overlaps = crosses_itself(loop);
  return flat;
}

}  // namespace atelier
