#include "bodymodel/underlying/vertex_energy.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace atelier {
namespace {

using Block = Eigen::MatrixXd;  // [V,3], column-major as the factor wants it

void check_energy(const VertexEnergy& energy, const Points& x) {
  const Index count = x.rows();
  ATELIER_CHECK(energy.edges.rows() == energy.edge_weights.size() &&
                    energy.edges.rows() == energy.edge_vectors.rows(),
                "every edge needs a weight and a vector");
  ATELIER_CHECK(energy.anchor_weights.size() == count && energy.anchors.rows() == count,
                "every vertex needs an anchor and its weight");
  ATELIER_CHECK(
      energy.edges.rows() == 0 || (energy.edges.minCoeff() >= 0 && energy.edges.maxCoeff() < count),
      "an edge names a vertex that is not there");
  for (const PlaneRow& row : energy.rows) {
    for (const int v : row.vertices) {
      ATELIER_CHECK(v >= 0 && v < count, "a row names a vertex that is not there");
    }
  }
}

double residual(const PlaneRow& row, const Points& x) {
  double along = -row.offset;
  for (int k = 0; k < 3; ++k) {
    along += row.barycentric[k] * x.row(row.vertices[static_cast<std::size_t>(k)]).dot(row.normal);
  }
  return along;
}

/// Half the derivative of weight rho(r), by r.
double weight_at(const PlaneRow& row, double r) {
  if (row.scale <= 0) {
    return row.weight;
  }
  const double fall = 1 + r * r / (row.scale * row.scale);
  return row.weight / (fall * fall);
}

/// Rows seen from their vertices, so that sums over rows need no scattered writes.
struct RowsOfVertices {
  std::vector<int> offsets;
  std::vector<int> items;  // 3 * row + k
};

RowsOfVertices rows_of_vertices(const std::vector<PlaneRow>& rows, Index count) {
  RowsOfVertices of;
  of.offsets.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const PlaneRow& row : rows) {
    for (const int v : row.vertices) {
      ++of.offsets[static_cast<std::size_t>(v) + 1];
    }
  }
  for (std::size_t v = 0; v < static_cast<std::size_t>(count); ++v) {
    of.offsets[v + 1] += of.offsets[v];
  }
  of.items.resize(3 * rows.size());
  std::vector<int> next(of.offsets.begin(), of.offsets.end() - 1);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t k = 0; k < 3; ++k) {
      auto& at = next[static_cast<std::size_t>(rows[r].vertices[k])];
      of.items[static_cast<std::size_t>(at++)] = static_cast<int>(3 * r + k);
    }
  }
  return of;
}

Eigen::SparseMatrix<double> coupling_matrix(const VertexEnergy& energy, Index count) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(static_cast<std::size_t>(4 * energy.edges.rows() + count));
  for (Index e = 0; e < energy.edges.rows(); ++e) {
    const int i = energy.edges(e, 0);
    const int j = energy.edges(e, 1);
    const double w = energy.edge_weights[e];
    triplets.emplace_back(i, i, w);
    triplets.emplace_back(j, j, w);
    triplets.emplace_back(i, j, -w);
    triplets.emplace_back(j, i, -w);
  }
  for (Index v = 0; v < count; ++v) {
    triplets.emplace_back(static_cast<int>(v), static_cast<int>(v), energy.anchor_weights[v]);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

/// The Gauss-Newton matrix at given row weights, as what it does to a block.
struct NormalMatrix {
  const Eigen::SparseMatrix<double>& coupling;
  const std::vector<PlaneRow>& rows;
  const RowsOfVertices& of;
  const std::vector<double>& weights;

  Block operator*(const Block& x) const {
    std::vector<double> pulls(rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r) {
      double along = 0;
      for (int k = 0; k < 3; ++k) {
        const int v = rows[r].vertices[static_cast<std::size_t>(k)];
        along +=
            rows[r].barycentric[k] * (rows[r].normal[0] * x(v, 0) + rows[r].normal[1] * x(v, 1) +
                                      rows[r].normal[2] * x(v, 2));
      }
      pulls[r] = weights[r] * along;
    }
    Block y = coupling * x;
    for (Index v = 0; v < x.rows(); ++v) {
      for (int at = of.offsets[static_cast<std::size_t>(v)];
           at < of.offsets[static_cast<std::size_t>(v) + 1]; ++at) {
        const int item = of.items[static_cast<std::size_t>(at)];
        const auto r = static_cast<std::size_t>(item / 3);
        y.row(v) += pulls[r] * rows[r].barycentric[item % 3] * rows[r].normal.transpose();
      }
    }
    return y;
  }
};

}  // namespace

Eigen::VectorXd edge_weights(const Topology& topology, const Points& vertices) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(topology.edges.rows());
  for (Index f = 0; f < topology.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int edge = topology.face_edges(f, k);
      if (edge < 0) {
        continue;
      }
      const Eigen::RowVector3d apex = vertices.row(topology.faces(f, (k + 2) % 3));
      const Eigen::Vector3d a = (vertices.row(topology.faces(f, k)) - apex).transpose();
      const Eigen::Vector3d b = (vertices.row(topology.faces(f, (k + 1) % 3)) - apex).transpose();
      const double area = a.cross(b).norm();
      weights[edge] += area > 0 ? std::clamp(0.5 * a.dot(b) / area, 0.0, 5.0) : 0;
    }
  }
  return weights.cwiseMax(0.05);
}

double row_weight(const PlaneRow& row, const Points& x) {
  return weight_at(row, residual(row, x));
}

Points vertex_energy_gradient(const VertexEnergy& energy, const Points& x) {
  check_energy(energy, x);
  Points gradient = Points::Zero(x.rows(), 3);
  for (Index e = 0; e < energy.edges.rows(); ++e) {
    const int i = energy.edges(e, 0);
    const int j = energy.edges(e, 1);
    const Eigen::RowVector3d pull =
        2 * energy.edge_weights[e] * (x.row(i) - x.row(j) - energy.edge_vectors.row(e));
    gradient.row(i) += pull;
    gradient.row(j) -= pull;
  }
  for (Index v = 0; v < x.rows(); ++v) {
    gradient.row(v) += 2 * energy.anchor_weights[v] * (x.row(v) - energy.anchors.row(v));
  }
  for (const PlaneRow& row : energy.rows) {
    const double r = residual(row, x);
    const double pull = 2 * weight_at(row, r) * r;
    for (int k = 0; k < 3; ++k) {
      gradient.row(row.vertices[static_cast<std::size_t>(k)]) +=
          pull * row.barycentric[k] * row.normal.transpose();
    }
  }
  return gradient;
}

Points lower_vertex_energy(const VertexEnergy& energy, const Points& start,
                           const VertexMinimumOptions& options) {
  check_energy(energy, start);
  const Index count = start.rows();
  const Eigen::SparseMatrix<double> coupling = coupling_matrix(energy, count);
  const RowsOfVertices of = rows_of_vertices(energy.rows, count);
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  factor.analyzePattern(coupling);
  Points x = start;
  std::vector<double> weights(energy.rows.size());
  for (int step = 0; step < options.steps; ++step) {
    Eigen::SparseMatrix<double> isotropic = coupling;
    for (std::size_t r = 0; r < energy.rows.size(); ++r) {
      const PlaneRow& row = energy.rows[r];
      weights[r] = weight_at(row, residual(row, x));
      for (int k = 0; k < 3; ++k) {
        const int v = row.vertices[static_cast<std::size_t>(k)];
        isotropic.coeffRef(v, v) += weights[r] * row.barycentric[k] * row.barycentric[k];
      }
    }
    factor.factorize(isotropic);
    ATELIER_CHECK(factor.info() == Eigen::Success, "a vertex that nothing holds");
    const NormalMatrix matrix{coupling, energy.rows, of, weights};
    Block left = -0.5 * vertex_energy_gradient(energy, x);
    Block move = Block::Zero(count, 3);
    Block scaled = factor.solve(left);
    Block direction = scaled;
    double product = left.cwiseProduct(scaled).sum();
    const double first = product;
    for (int i = 0; i < options.iterations && product > 0; ++i) {
      const Block pushed = matrix * direction;
      const double length = product / direction.cwiseProduct(pushed).sum();
      move += length * direction;
      left -= length * pushed;
      scaled = factor.solve(left);
      const double next = left.cwiseProduct(scaled).sum();
      if (!(next > options.tolerance * options.tolerance * first)) {
        break;
      }
      direction = scaled + next / product * direction;
      product = next;
    }
    x += move;
  }
  return x;
}

}  // namespace atelier
