#include "registration/flattening/cross_field.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <complex>

#include "core/error.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "registration/edge_paths.h"

namespace atelier {
namespace {

using Complex = std::complex<double>;

constexpr double kAlike = 4;          // 1/m: a difference of curvatures that counts half
constexpr double kBorderWeight = 10;  // of the weight of the clearest curvature

/// Two unit vectors in a face.
struct CrossFrame {
  Eigen::Vector3d x, y;
};

CrossFrame cross_frame(const Mesh& mesh, Index f) {
  const Eigen::Vector3d a = mesh.vertices.row(mesh.faces(f, 0));
  const Eigen::Vector3d ab = mesh.vertices.row(mesh.faces(f, 1)).transpose() - a;
  const Eigen::Vector3d ac = mesh.vertices.row(mesh.faces(f, 2)).transpose() - a;
  const Eigen::Vector3d x = ab.normalized();
  return {x, (ac - ac.dot(x) * x).normalized()};
}

double angle_in(const CrossFrame& frame, const Eigen::Vector3d& direction) {
  return std::atan2(direction.dot(frame.y), direction.dot(frame.x));
}

Complex cross_at(double angle) {
  return std::polar(1.0, 4 * angle);
}

/// Normals of vertices, averaged with their neighbours over about `reach`.
Points smooth_normals(const Mesh& mesh, const Topology& topology, double reach) {
  constexpr double kMostRounds = 60;
  Points normals = vertex_normals(mesh.vertices, mesh.faces);
  const std::vector<double> lengths = edge_lengths(topology, mesh.vertices);
  double mean = 0;
  for (const double length : lengths) {
    mean += length / static_cast<double>(lengths.size());
  }
  const double edges = reach / std::max(mean, 1e-9);
  const int rounds = saturating_cast<int>(std::clamp(edges * edges / 2, 1.0, kMostRounds));
  for (int round = 0; round < rounds; ++round) {
    Points sums = normals;
    for (Index e = 0; e < topology.edges.rows(); ++e) {
      sums.row(topology.edges(e, 0)) += normals.row(topology.edges(e, 1));
      sums.row(topology.edges(e, 1)) += normals.row(topology.edges(e, 0));
    }
    normals = sums.rowwise().normalized();
  }
  return normals;
}

/// The cross of the principal directions, as long as the curvatures differ: 0 to 1.
Complex principal_cross(const Mesh& mesh, const Points& normals, const CrossFrame& frame, Index f) {
  Eigen::Matrix<double, 6, 3> system = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 1> right;
  for (int k = 0; k < 3; ++k) {
    const int a = mesh.faces(f, k);
    const int b = mesh.faces(f, (k + 1) % 3);
    const Eigen::Vector3d edge = mesh.vertices.row(b) - mesh.vertices.row(a);
    const Eigen::Vector3d turn = normals.row(b) - normals.row(a);
    const Eigen::Vector2d along(edge.dot(frame.x), edge.dot(frame.y));
    // Second fundamental form (xx, xy, yy) times the edge is the normal's turn.
    system.row(2 * k) << along.x(), along.y(), 0;
    system.row(2 * k + 1) << 0, along.x(), along.y();
    right[2 * k] = turn.dot(frame.x);
    right[2 * k + 1] = turn.dot(frame.y);
  }
  const Eigen::Vector3d form = system.colPivHouseholderQr().solve(right);
  const double differ = std::hypot(form[0] - form[2], 2 * form[1]);
  if (!(differ > 0) || !std::isfinite(differ)) {
    return 0;
  }
  const double angle = std::atan2(2 * form[1], form[0] - form[2]) / 2;
  return differ / (differ + kAlike) * cross_at(angle);
}

}  // namespace

Points cross_field(const Mesh& mesh, const Topology& topology, double reach) {
  ATELIER_CHECK(reach > 0, "a reach of more than zero");
  const Index faces = mesh.faces.rows();
  const Eigen::VectorXd areas = face_areas(mesh.vertices, mesh.faces);
  const Points normals = smooth_normals(mesh, topology, reach);
  std::vector<CrossFrame> frames;
  std::vector<Eigen::Triplet<Complex>> entries;
  Eigen::VectorXcd right(faces);
  for (Index f = 0; f < faces; ++f) {
    frames.push_back(cross_frame(mesh, f));
    const Complex wanted = principal_cross(mesh, normals, frames.back(), f);
    const double area = std::max(areas[f], 1e-12);
    entries.emplace_back(f, f, area * std::max(std::abs(wanted), 1e-3));
    right[f] = area * wanted;
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const auto sharing = corners_of_edge(topology, e);
    const Eigen::Vector3d along =
        mesh.vertices.row(topology.edges(e, 1)) - mesh.vertices.row(topology.edges(e, 0));
    const int f = sharing[0] / 3;
    const Complex at_f = cross_at(angle_in(frames[static_cast<std::size_t>(f)], along));
    if (sharing.size() == 1) {
      entries.emplace_back(f, f, kBorderWeight * areas[f]);
      right[f] += kBorderWeight * areas[f] * at_f;
      continue;
    }
    if (sharing.size() != 2) {
      continue;
    }
    // The same cross from both sides has the same angle to the edge.
    const int g = sharing[1] / 3;
    const Complex at_g = cross_at(angle_in(frames[static_cast<std::size_t>(g)], along));
    const double weight = reach * reach;
    const Complex carried = at_f * std::conj(at_g);
    entries.emplace_back(f, f, weight);
    entries.emplace_back(g, g, weight);
    entries.emplace_back(f, g, -weight * carried);
    entries.emplace_back(g, f, -weight * std::conj(carried));
  }
  Eigen::SparseMatrix<Complex> system(faces, faces);
  system.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<Complex>> solver(system);
  const Eigen::VectorXcd crosses =
      solver.info() == Eigen::Success ? Eigen::VectorXcd(solver.solve(right)) : right;
  Points field(faces, 3);
  for (Index f = 0; f < faces; ++f) {
    const CrossFrame& frame = frames[static_cast<std::size_t>(f)];
    const double angle = std::arg(crosses[f]) / 4;
    field.row(f) = (std::cos(angle) * frame.x + std::sin(angle) * frame.y).transpose();
  }
  return field;
}

std::vector<double> off_field(const Mesh& mesh, const Topology& topology, const Points& field) {
  ATELIER_CHECK(field.rows() == mesh.faces.rows(), "a direction for each face");
  std::vector<double> off(static_cast<std::size_t>(topology.edges.rows()), 0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const Eigen::RowVector3d along =
        (mesh.vertices.row(topology.edges(e, 1)) - mesh.vertices.row(topology.edges(e, 0)))
            .normalized();
    const auto sharing = corners_of_edge(topology, e);
    for (const int corner : sharing) {
      const double cosine = std::clamp(along.dot(field.row(corner / 3)), -1.0, 1.0);
      // sin(2a)^2 = 4 sin(a)^2 cos(a)^2
      off[static_cast<std::size_t>(e)] +=
          4 * cosine * cosine * (1 - cosine * cosine) / static_cast<double>(sharing.size());
    }
  }
  return off;
}

}  // namespace atelier
