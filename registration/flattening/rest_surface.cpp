#include "registration/flattening/rest_surface.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/laplacian.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "registration/edge_paths.h"

namespace atelier {
namespace {

constexpr double kMaxChange = 0.3;  // of a length: no fold takes more
constexpr double kStay = 1e-4;      // of a vertex's own place, so that it is somewhere

Eigen::VectorXd lengths_of(const Topology& topology, const Points& points) {
  const std::vector<double> lengths = edge_lengths(topology, points);
  return Eigen::Map<const Eigen::VectorXd>(lengths.data(), static_cast<Index>(lengths.size()));
}

/// The length that each edge has in the frames in which it is long.
Eigen::VectorXd long_lengths(const Topology& topology, const std::vector<Points>& frames,
                             double quantile) {
  const Index edges = topology.edges.rows();
  std::vector<std::vector<double>> of_frame;
  of_frame.reserve(frames.size());
  for (const Points& frame : frames) {
    of_frame.push_back(edge_lengths(topology, frame));
  }
  const auto rank = saturating_cast<std::ptrdiff_t>(
      std::round(quantile * static_cast<double>(frames.size() - 1)));
  Eigen::VectorXd lengths(edges);
  std::vector<double> own(frames.size());
  for (Index e = 0; e < edges; ++e) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      own[i] = of_frame[i][static_cast<std::size_t>(e)];
    }
    std::nth_element(own.begin(), own.begin() + rank, own.end());
    lengths[e] = own[static_cast<std::size_t>(rank)];
  }
  return lengths;
}

/// How much more each vertex's surroundings are to have, by direction: symmetric tensors, [V,6] of
/// xx, yy, zz, xy, xz, yz.
using Tensors = Eigen::MatrixXd;

Eigen::Matrix<double, 6, 1> packed(const Eigen::Matrix3d& t) {
  Eigen::Matrix<double, 6, 1> six;
  six << t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(0, 2), t(1, 2);
  return six;
}

/// The square that a tensor gives a way.
double along(const Eigen::Vector3d& way, const Eigen::Matrix<double, 1, 6>& t) {
  const double x = way.x();
  const double y = way.y();
  const double z = way.z();
  return t[0] * x * x + t[1] * y * y + t[2] * z * z +
         2 * (t[3] * x * y + t[4] * x * z + t[5] * y * z);
}

/// A surface whose edges want other lengths: averages what they lack, by direction.
class Averaging {
 public:
  Averaging(const Mesh& mesh, const Topology& topology, double reach)
      : faces_(mesh.faces), topology_(topology) {
    Eigen::SparseMatrix<double> system =
        reach * reach * cotangent_laplacian(mesh.vertices, mesh.faces, {.skip_degenerate = true});
    const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
    for (Index f = 0; f < areas.size(); ++f) {
      for (int k = 0; k < 3; ++k) {
        system.coeffRef(faces_(f, k), faces_(f, k)) += areas[f] / 3;
      }
    }
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      system.coeffRef(v, v) += 1e-12;  // vertices without faces
    }
    solver_.compute(system);
  }

  bool possible() const { return solver_.info() == Eigen::Success; }

  /// The lengths of edges from `points`, when those that are wanted are averaged.
  Eigen::VectorXd lengths(const Points& points, const Eigen::VectorXd& wanted) const {
    // A face's tensor gives each of its sides the square that it lacks: sums of products of the
    // gradients of two corners, by what the side between them lacks. Beside it the one that gives
    // each way its own square, which bends out of tangent planes alike.
    Tensors lacking = Tensors::Zero(points.rows(), 6);
    Tensors having = Tensors::Zero(points.rows(), 6);
    for (Index f = 0; f < faces_.rows(); ++f) {
      const auto corner = [&](int k) -> Eigen::Vector3d {
        return points.row(faces_(f, k % 3)).transpose();
      };
      const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      const double square = normal.squaredNorm();
      double longest = 0;
      for (int k = 0; k < 3; ++k) {
        longest = std::max(longest, (corner(k + 1) - corner(k)).squaredNorm());
      }
      constexpr double kSliver = 0.1;  // of its longest side: a height that says nothing
      if (!(std::sqrt(square) > kSliver * longest)) {
        continue;
      }
      Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
      Eigen::Matrix3d gradients;
      for (int k = 0; k < 3; ++k) {
        gradients.col(k) = normal.cross(corner(k + 2) - corner(k + 1)) / square;
      }
      for (int k = 0; k < 3; ++k) {  // the side from corner k to the next
        const double length = wanted[topology_.face_edges(f, k)];
        const double lacks = length * length - (corner(k + 1) - corner(k)).squaredNorm();
        const Eigen::Matrix3d product = gradients.col(k) * gradients.col((k + 1) % 3).transpose();
        tensor -= lacks / 2 * (product + product.transpose());
      }
      const double share = std::sqrt(square) / 6;
      const Eigen::Matrix3d plane =
          Eigen::Matrix3d::Identity() - normal * normal.transpose() / square;
      for (int k = 0; k < 3; ++k) {
        lacking.row(faces_(f, k)) += share * packed(tensor).transpose();
        having.row(faces_(f, k)) += share * packed(plane).transpose();
      }
    }
    lacking = solver_.solve(lacking);
    having = solver_.solve(having);
    Eigen::VectorXd lengths(topology_.edges.rows());
    for (Index e = 0; e < lengths.size(); ++e) {
      const int a = topology_.edges(e, 0);
      const int b = topology_.edges(e, 1);
      const Eigen::Vector3d way = (points.row(b) - points.row(a)).transpose();
      const double has = along(way, having.row(a) + having.row(b));
      const double more = has > 0 ? along(way, lacking.row(a) + lacking.row(b)) / has : 0;
      lengths[e] = way.norm() *
                   std::clamp(std::sqrt(std::max(1 + more, 0.0)), 1 - kMaxChange, 1 + kMaxChange);
    }
    return lengths;
  }

 private:
  const Triangles& faces_;
  const Topology& topology_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

/// Points turned about +Y and moved to where others are.
Points turned_to(const Points& points, const Points& others) {
  const Eigen::RowVector3d middle = points.colwise().mean();
  const Eigen::RowVector3d other = others.colwise().mean();
  double cosine = 0;
  double sine = 0;
  for (Index v = 0; v < points.rows(); ++v) {
    const Eigen::RowVector3d a = points.row(v) - middle;
    const Eigen::RowVector3d b = others.row(v) - other;
    cosine += a.x() * b.x() + a.z() * b.z();
    sine += a.z() * b.x() - a.x() * b.z();
  }
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(std::atan2(sine, cosine), Eigen::Vector3d::UnitY()).toRotationMatrix();
  return ((points.rowwise() - middle) * turn.transpose()).rowwise() + other;
}

/// Each vertex less the mean of its neighbours, [V,V].
Eigen::SparseMatrix<double> graph_laplacian(const Topology& topology, Index vertices) {
  Eigen::VectorXd degree = Eigen::VectorXd::Zero(vertices);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    degree[topology.edges(e, 0)] += 1;
    degree[topology.edges(e, 1)] += 1;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    for (int k = 0; k < 2; ++k) {
      const int v = topology.edges(e, k);
      entries.emplace_back(v, topology.edges(e, 1 - k), -1 / degree[v]);
    }
  }
  for (Index v = 0; v < vertices; ++v) {
    entries.emplace_back(v, v, degree[v] > 0 ? 1 : 0);
  }
  Eigen::SparseMatrix<double> laplacian(vertices, vertices);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  return laplacian;
}

}  // namespace

Points rest_surface(const Mesh& mesh, const std::vector<Points>& frames,
                    const RestSurfaceOptions& options) {
  const Index count = mesh.vertices.rows();
  ATELIER_CHECK(options.quantile >= 0 && options.quantile <= 1, "a quantile in [0, 1]");
  ATELIER_CHECK(options.reach > 0, "a reach of more than zero");
  ATELIER_CHECK(mesh.vertices.allFinite(), "coordinates must be finite");
  for (const Points& frame : frames) {
    ATELIER_CHECK(frame.rows() == count && frame.allFinite(),
                  "finite vertices of the mesh in each frame");
  }
  if (frames.size() < kRestFrames || mesh.faces.rows() == 0) {
    return mesh.vertices;
  }
  const Topology topology = topology_of(mesh.faces, count);
  const Eigen::VectorXd wanted = long_lengths(topology, frames, options.quantile);
  const Averaging averaging(mesh, topology, options.reach);
  if (!averaging.possible()) {
    return mesh.vertices;
  }
  Points least_folded;
  Eigen::VectorXd lengths;
  double least = std::numeric_limits<double>::infinity();
  for (const Points& frame : frames) {
    Eigen::VectorXd averaged = averaging.lengths(frame, wanted);
    const double lacks = (averaged - lengths_of(topology, frame)).squaredNorm();
    if (lacks < least) {
      least = lacks;
      least_folded = frame;
      lengths = std::move(averaged);
    }
  }

  const Eigen::SparseMatrix<double> laplacian = graph_laplacian(topology, count);
  Eigen::SparseMatrix<double> together = laplacian.transpose() * laplacian;
  for (Index v = 0; v < count; ++v) {
    together.coeffRef(v, v) += kStay;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (Index e = 0; e < lengths.size(); ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    entries.emplace_back(a, a, 1);
    entries.emplace_back(b, b, 1);
    entries.emplace_back(a, b, -1);
    entries.emplace_back(b, a, -1);
  }
  Eigen::SparseMatrix<double> edges(count, count);
  edges.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(
      Eigen::SparseMatrix<double>(edges + together));
  if (solver.info() != Eigen::Success) {
    return mesh.vertices;
  }
  const Eigen::MatrixX3d stay = together * least_folded;
  Points points = least_folded;
  constexpr int kRounds = 25;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixX3d right = stay;
    for (Index e = 0; e < lengths.size(); ++e) {
      const int a = topology.edges(e, 0);
      const int b = topology.edges(e, 1);
      const Eigen::RowVector3d way = points.row(a) - points.row(b);
      const double length = way.norm();
      if (length > 0) {
        const Eigen::RowVector3d whole = lengths[e] / length * way;
        right.row(a) += whole;
        right.row(b) -= whole;
      }
    }
    points = solver.solve(right);
  }
  return turned_to(points, mesh.vertices);
}

}  // namespace atelier
