#include "registration/tracking/cloth_energy.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/normals.h"
#include "registration/tracking/factor_solve.h"
#include "registration/tracking/wide_numbers.h"

namespace atelier {
namespace {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

Vector3 at(const Points& x, int v) {
  return x.row(v).transpose();
}

/// Cotangent of the angle at `corner` between `a` and `b`.
double cotangent(const Vector3& corner, const Vector3& a, const Vector3& b) {
  const Vector3 u = a - corner;
  const Vector3 v = b - corner;
  return u.dot(v) / u.cross(v).norm();
}

double residual(const SurfaceRow& row, const Points& x) {
  double along = -row.offset;
  for (int k = 0; k < 3; ++k) {
    along += row.barycentric[k] * x.row(row.vertices[static_cast<std::size_t>(k)]).dot(row.normal);
  }
  return along;
}

/// Half the derivative of weight rho(r), over r.
double weight_at(const SurfaceRow& row, double r) {
  if (row.scale <= 0) {
    return row.weight;
  }
  const double fall = 1 + r * r / (row.scale * row.scale);
  return row.weight / (fall * fall);
}

double stiffness(const ClothTerms& terms, double length, double rest) {
  return length > rest ? terms.stretch : terms.compress;
}

Eigen::Matrix<double, 9, 1> moved_corners(const ClothModel& model, const ClothTerms& terms,
                                          int face, const Points& x) {
  Eigen::Matrix<double, 9, 1> d;
  for (int k = 0; k < 3; ++k) {
    const int v = model.topology.faces(face, k);
    d.segment<3>(3 * k) = (x.row(v) - terms.origin.row(v)).transpose();
  }
  return d;
}

void check_terms(const ClothModel& model, const ClothTerms& terms, const Points& x) {
  const Index vertices = model.topology.vertex_count;
  const Index edges = model.topology.edges.rows();
  ATELIER_CHECK(x.rows() == vertices, "a shape of another cloth");
  ATELIER_CHECK(terms.edge_weights.size() == 0 ||
                    (terms.edge_weights.size() == edges && terms.edge_vectors.rows() == edges),
                "every edge needs a weight and a vector");
  ATELIER_CHECK(terms.anchor_weights.size() == 0 ||
                    (terms.anchor_weights.size() == vertices && terms.anchors.rows() == vertices),
                "every vertex needs an anchor and its weight");
  ATELIER_CHECK(terms.quadratics.empty() || terms.origin.rows() == vertices,
                "quadratics need the shape at which they were made");
}

}  // namespace

ClothModel cloth_model(const Points& vertices, const Triangles& faces, const std::string& file) {
  if (faces.rows() == 0) {
    throw DataError(file, "faces", "none", "a garment's triangles");
  }
  ClothModel model;
  model.topology = topology_of(faces, vertices.rows());
  const ManifoldDefects defects = manifold_defects(model.topology);
  if (!is_manifold(defects)) {
    const auto findings = findings_of(defects, model.topology);
    throw DataError(file, "faces", findings.empty() ? "no manifold" : to_string(findings.front()),
                    "a garment's surface with two faces at each edge and one side out");
  }
  if (!defects.isolated_vertices.empty()) {
    throw DataError(file, "vertex " + std::to_string(defects.isolated_vertices.front()),
                    "no face with it", "a mesh without loose vertices");
  }
  const Eigen::VectorXd face_area = face_areas(vertices, faces);
  for (Index f = 0; f < faces.rows(); ++f) {
    if (!(face_area[f] > 1e-12)) {
      throw DataError(file, "face " + std::to_string(f), "no area", "triangles with an area");
    }
  }
  const Topology& topology = model.topology;
  const Index edges = topology.edges.rows();
  model.areas = vertex_areas(vertices, faces);
  model.lengths.resize(edges);
  model.edge_areas = Eigen::VectorXd::Zero(edges);
  std::vector<std::array<int, 4>> hinges;
  std::vector<std::array<double, 4>> weights;
  for (Index e = 0; e < edges; ++e) {
    const int a = topology.edges(e, 0);
    const int b = topology.edges(e, 1);
    model.lengths[e] = (vertices.row(a) - vertices.row(b)).norm();
    const auto corners = corners_of_edge(topology, e);
    for (const int corner : corners) {
      model.edge_areas[e] += face_area[corner / 3] / 3;
    }
    if (corners.size() != 2) {
      continue;
    }
    const auto apex = [&](int corner) { return faces(corner / 3, (corner % 3 + 2) % 3); };
    const int c = apex(corners[0]);
    const int d = apex(corners[1]);
    if (c == d) {
      continue;
    }
    const Vector3 xa = at(vertices, a);
    const Vector3 xb = at(vertices, b);
    const Vector3 xc = at(vertices, c);
    const Vector3 xd = at(vertices, d);
    const double ac = cotangent(xa, xb, xc);
    const double ad = cotangent(xa, xb, xd);
    const double bc = cotangent(xb, xa, xc);
    const double bd = cotangent(xb, xa, xd);
    const double area = face_area[corners[0] / 3] + face_area[corners[1] / 3];
    const double scale = std::sqrt(1 / area);
    hinges.push_back({a, b, c, d});
    weights.push_back(
        {scale * (bc + bd), scale * (ac + ad), -scale * (ac + bc), -scale * (ad + bd)});
  }
  model.hinges.resize(static_cast<Index>(hinges.size()), 4);
  model.hinge_weights.resize(static_cast<Index>(hinges.size()), 4);
  for (std::size_t h = 0; h < hinges.size(); ++h) {
    for (std::size_t k = 0; k < 4; ++k) {
      model.hinges(static_cast<Index>(h), static_cast<Index>(k)) = hinges[h][k];
      model.hinge_weights(static_cast<Index>(h), static_cast<Index>(k)) = weights[h][k];
    }
  }
  return model;
}

double row_weight(const SurfaceRow& row, const Points& x) {
  return weight_at(row, residual(row, x));
}

double cloth_energy(const ClothModel& model, const ClothTerms& terms, const Points& x) {
  check_terms(model, terms, x);
  const Edges& edges = model.topology.edges;
  double sum = 0;
  for (Index e = 0; e < edges.rows(); ++e) {
    const Eigen::RowVector3d along = x.row(edges(e, 0)) - x.row(edges(e, 1));
    const double length = along.norm();
    const double strain = length / model.lengths[e] - 1;
    sum += stiffness(terms, length, model.lengths[e]) * model.edge_areas[e] * strain * strain;
    if (terms.edge_weights.size() > 0) {
      sum += terms.edge_weights[e] * (along - terms.edge_vectors.row(e)).squaredNorm();
    }
  }
  if (terms.bend > 0) {
    for (Index h = 0; h < model.hinges.rows(); ++h) {
      Eigen::RowVector3d bent = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 4; ++k) {
        bent += model.hinge_weights(h, k) * x.row(model.hinges(h, k));
      }
      sum += terms.bend * bent.squaredNorm();
    }
  }
  for (Index v = 0; v < terms.anchor_weights.size(); ++v) {
    sum += terms.anchor_weights[v] * (x.row(v) - terms.anchors.row(v)).squaredNorm();
  }
  for (const SurfaceRow& row : terms.rows) {
    const double r = residual(row, x);
    sum += row.weight * r * r / (row.scale > 0 ? 1 + r * r / (row.scale * row.scale) : 1);
  }
  for (const FaceQuadratic& q : terms.quadratics) {
    const auto d = moved_corners(model, terms, q.face, x);
    sum += d.dot(q.H * d) + 2 * q.g.dot(d);
  }
  return sum;
}

Points cloth_energy_gradient(const ClothModel& model, const ClothTerms& terms, const Points& x) {
  check_terms(model, terms, x);
  const Edges& edges = model.topology.edges;
  Points gradient = Points::Zero(x.rows(), 3);
  for (Index e = 0; e < edges.rows(); ++e) {
    const Eigen::RowVector3d along = x.row(edges(e, 0)) - x.row(edges(e, 1));
    const double length = std::max(along.norm(), 1e-12);
    const double rest = model.lengths[e];
    Eigen::RowVector3d pull = 2 * stiffness(terms, length, rest) * model.edge_areas[e] *
                              (length / rest - 1) / (rest * length) * along;
    if (terms.edge_weights.size() > 0) {
      pull += 2 * terms.edge_weights[e] * (along - terms.edge_vectors.row(e));
    }
    gradient.row(edges(e, 0)) += pull;
    gradient.row(edges(e, 1)) -= pull;
  }
  if (terms.bend > 0) {
    for (Index h = 0; h < model.hinges.rows(); ++h) {
      Eigen::RowVector3d bent = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 4; ++k) {
        bent += model.hinge_weights(h, k) * x.row(model.hinges(h, k));
      }
      for (int k = 0; k < 4; ++k) {
        gradient.row(model.hinges(h, k)) += 2 * terms.bend * model.hinge_weights(h, k) * bent;
      }
    }
  }
  for (Index v = 0; v < terms.anchor_weights.size(); ++v) {
    gradient.row(v) += 2 * terms.anchor_weights[v] * (x.row(v) - terms.anchors.row(v));
  }
  for (const SurfaceRow& row : terms.rows) {
    const double r = residual(row, x);
    const double pull = 2 * weight_at(row, r) * r;
    for (int k = 0; k < 3; ++k) {
      gradient.row(row.vertices[static_cast<std::size_t>(k)]) +=
          pull * row.barycentric[k] * row.normal.transpose();
    }
  }
  for (const FaceQuadratic& q : terms.quadratics) {
    const Eigen::Matrix<double, 9, 1> pull =
        2 * (q.H * moved_corners(model, terms, q.face, x) + q.g);
    for (int k = 0; k < 3; ++k) {
      gradient.row(model.topology.faces(q.face, k)) += pull.segment<3>(3 * k).transpose();
    }
  }
  return gradient;
}

/// The matrix's values lie column by column; a block of vertices (i, j), i > j, is three runs of
/// three rows. Diagonal blocks keep their lower halves.
struct ShapeSolver::State {
  explicit State(const ClothModel& model_) : model(model_) {}

  const ClothModel& model;
  Eigen::SparseMatrix<double> matrix;
  // For preconditioner: the mean of each block's diagonal, one scalar a pair of vertices.
  Eigen::SparseMatrix<double> scalar;
  std::vector<std::array<int, 3>> scalar_places;  // [nonzeros] into the matrix's values
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor;
  std::vector<std::array<int, 3>> edge_places;    // [E] where columns of the block begin
  std::vector<std::array<int, 3>> apex_places;    // [H] of the two apexes
  std::vector<std::array<int, 3>> vertex_places;  // [V] the diagonal entries
  std::vector<std::array<int, 5>> hinge_edges;    // [H] edges a-b, a-c, b-c, a-d, b-d
  Eigen::Matrix<double, 4, Eigen::Dynamic> work;  // [4,V] of precondition: x, y, z and 0
  int fresh_iterations = 0;                       // that were needed when the factor was new
  int last_iterations = 0;                        // and the last time; 0: there is no factor

  void add_diagonal(int v, const Matrix3& block) {
    double* values = matrix.valuePtr();
    for (int c = 0; c < 3; ++c) {
      const int place = vertex_places[static_cast<std::size_t>(v)][static_cast<std::size_t>(c)];
      for (int r = c; r < 3; ++r) {
        values[place + r - c] += block(r, c);
      }
    }
  }
  /// matrix * x, block by block: the three columns of a vertex have the same rows.
  void multiply(const Points& x, Points& product) const {
    product.setZero();
    const int* outer = matrix.outerIndexPtr();
    for (Index v = 0; v < x.rows(); ++v) {
      const int first = outer[3 * v];
      const double* a = matrix.valuePtr() + first;
      const double* b = matrix.valuePtr() + outer[3 * v + 1];
      const double* c = matrix.valuePtr() + outer[3 * v + 2];
      const Vector3 own = at(x, static_cast<int>(v));
      Vector3 sum(a[0] * own[0] + a[1] * own[1] + a[2] * own[2],
                  a[1] * own[0] + b[0] * own[1] + b[1] * own[2],
                  a[2] * own[0] + b[1] * own[1] + c[0] * own[2]);
      a += 3;
      b += 2;
      c += 1;
      const int* row = matrix.innerIndexPtr() + first + 3;
      const int* end = matrix.innerIndexPtr() + outer[3 * v + 1];
      for (; row < end; row += 3, a += 3, b += 3, c += 3) {
        const double* other = x.data() + *row;
        double* to = product.data() + *row;
        for (int k = 0; k < 3; ++k) {
          to[k] += a[k] * own[0] + b[k] * own[1] + c[k] * own[2];
        }
        sum[0] += a[0] * other[0] + a[1] * other[1] + a[2] * other[2];
        sum[1] += b[0] * other[0] + b[1] * other[1] + b[2] * other[2];
        sum[2] += c[0] * other[0] + c[1] * other[1] + c[2] * other[2];
      }
      product.row(v) += sum.transpose();
    }
  }
  /// The preconditioner's inverse times `points`.
  void precondition(const Points& points, Points& scaled) {
    const auto& lower = factor.matrixL().nestedExpression();
    const auto& order = factor.permutationP().indices();
    const auto place = [&](Index v) { return order.size() > 0 ? order[v] : static_cast<int>(v); };
    for (Index v = 0; v < points.rows(); ++v) {
      work.col(place(v)) << points(v, 0), points(v, 1), points(v, 2), 0;
    }
    solve_factor(
        {lower.outerIndexPtr(), lower.innerIndexPtr(), lower.valuePtr(), factor.vectorD().data()},
        work, has_avx2());
    for (Index v = 0; v < points.rows(); ++v) {
      scaled.row(v) = work.col(place(v)).head<3>().transpose();
    }
  }
  /// Conjugate gradients. A factor of an earlier step serves as long as it is good enough: it does
  /// where it needs no more iterations than about twice as many as when it was fresh, which cost
  /// less than a new one. False where the matrix has no factor.
  bool solve(Points left, Points& move) {
    constexpr int kMost = 200;
    // Of the first residual's norm: what is left over the next step has again.
    constexpr double kTolerance = 1e-2;
    constexpr double kWorse = 1.5;  // from one step to the next
    constexpr double kWorst = 2;    // within one
    const auto dot = [](const Points& a, const Points& b) { return a.cwiseProduct(b).sum(); };
    const auto make_factor = [&] {
      factor.factorize(scalar);
      return factor.info() == Eigen::Success;
    };
    bool fresh = !(last_iterations > 0 && last_iterations <= kWorse * fresh_iterations);
    if (fresh && !make_factor()) {
      return false;
    }
    move = Points::Zero(left.rows(), 3);
    Points scaled(left.rows(), 3);
    precondition(left, scaled);
    Points direction = scaled;
    Points pushed(left.rows(), 3);
    double product = dot(left, scaled);
    double first = product;
    int count = 0;
    for (int all = 0; all < kMost && product > 0; ++all) {
      if (!fresh && count > kWorst * fresh_iterations + 3) {
        if (!make_factor()) {
          return false;
        }
        fresh = true;
        count = 0;
        precondition(left, scaled);
        direction = scaled;
        product = dot(left, scaled);
      }
      multiply(direction, pushed);
      const double length = product / dot(direction, pushed);
      move += length * direction;
      left -= length * pushed;
      precondition(left, scaled);
      ++count;
      const double next = dot(left, scaled);
      if (!(next > kTolerance * kTolerance * first)) {
        break;
      }
      direction = scaled + next / product * direction;
      product = next;
    }
    last_iterations = count;
    if (fresh) {
      fresh_iterations = count;
    }
    return true;
  }
  /// `block` relates vertex i (rows) to j (columns), whose block begins at `places`.
  void add_block(const std::array<int, 3>& places, int i, int j, const Matrix3& block) {
    double* values = matrix.valuePtr();
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) {
        values[places[static_cast<std::size_t>(c)] + r] += i > j ? block(r, c) : block(c, r);
      }
    }
  }
};

ShapeSolver::ShapeSolver(const ClothModel& model) : state_(std::make_unique<State>(model)) {
  ATELIER_CHECK((model.lengths.array() > 0).all(), "every edge is longer than nothing at rest");
  State& state = *state_;
  const Topology& topology = model.topology;
  const auto vertices = static_cast<int>(topology.vertex_count);
  std::map<std::array<int, 2>, int> edge_of;
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    edge_of[{topology.edges(e, 0), topology.edges(e, 1)}] = static_cast<int>(e);
  }
  std::vector<Eigen::Triplet<double>> triplets;
  const auto block = [&](int i, int j) {
    const int high = std::max(i, j);
    const int low = std::min(i, j);
    for (int c = 0; c < 3; ++c) {
      for (int r = i == j ? c : 0; r < 3; ++r) {
        triplets.emplace_back(3 * high + r, 3 * low + c, 0.0);
      }
    }
  };
  for (int v = 0; v < vertices; ++v) {
    block(v, v);
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    block(topology.edges(e, 0), topology.edges(e, 1));
  }
  for (Index h = 0; h < model.hinges.rows(); ++h) {
    block(model.hinges(h, 2), model.hinges(h, 3));
  }
  state.matrix.resize(3 * vertices, 3 * vertices);
  state.matrix.setFromTriplets(triplets.begin(), triplets.end());
  const auto places_of = [&](int i, int j) {
    const int high = std::max(i, j);
    const int low = std::min(i, j);
    std::array<int, 3> places{};
    for (int c = 0; c < 3; ++c) {
      const int column = 3 * low + c;
      const int row = 3 * high + (i == j ? c : 0);
      const int* begin = state.matrix.innerIndexPtr() + state.matrix.outerIndexPtr()[column];
      const int* end = state.matrix.innerIndexPtr() + state.matrix.outerIndexPtr()[column + 1];
      places[static_cast<std::size_t>(c)] =
          static_cast<int>(std::lower_bound(begin, end, row) - state.matrix.innerIndexPtr());
    }
    return places;
  };
  for (int v = 0; v < vertices; ++v) {
    state.vertex_places.push_back(places_of(v, v));
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    state.edge_places.push_back(places_of(topology.edges(e, 0), topology.edges(e, 1)));
  }
  for (Index h = 0; h < model.hinges.rows(); ++h) {
    const auto edge = [&](int i, int j) {
      const int a = model.hinges(h, i);
      const int b = model.hinges(h, j);
      return edge_of.at({std::min(a, b), std::max(a, b)});
    };
    state.hinge_edges.push_back({edge(0, 1), edge(0, 2), edge(1, 2), edge(0, 3), edge(1, 3)});
    state.apex_places.push_back(places_of(model.hinges(h, 2), model.hinges(h, 3)));
  }
  std::vector<Eigen::Triplet<double>> pairs;
  const auto pair = [&](int i, int j) { pairs.emplace_back(std::max(i, j), std::min(i, j), 1.0); };
  for (int v = 0; v < vertices; ++v) {
    pair(v, v);
  }
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    pair(topology.edges(e, 0), topology.edges(e, 1));
  }
  for (Index h = 0; h < model.hinges.rows(); ++h) {
    pair(model.hinges(h, 2), model.hinges(h, 3));
  }
  state.scalar.resize(vertices, vertices);
  state.scalar.setFromTriplets(pairs.begin(), pairs.end());
  for (int j = 0; j < vertices; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(state.scalar, j); it; ++it) {
      std::array<int, 3> places = places_of(static_cast<int>(it.row()), j);
      if (it.row() != j) {
        for (int c = 0; c < 3; ++c) {
          places[static_cast<std::size_t>(c)] += c;
        }
      }
      state.scalar_places.push_back(places);
    }
  }
  state.factor.analyzePattern(state.scalar);
  state.work.resize(4, vertices);
}

ShapeSolver::~ShapeSolver() = default;
ShapeSolver::ShapeSolver(ShapeSolver&&) noexcept = default;
ShapeSolver& ShapeSolver::operator=(ShapeSolver&&) noexcept = default;

const Eigen::SparseMatrix<double>& ShapeSolver::matrix(const ClothTerms& terms, const Points& x) {
  State& state = *state_;
  const ClothModel& model = state.model;
  check_terms(model, terms, x);
  const Topology& topology = model.topology;
  double* values = state.matrix.valuePtr();
  std::fill(values, values + state.matrix.nonZeros(), 0.0);
  for (Index e = 0; e < topology.edges.rows(); ++e) {
    const int i = topology.edges(e, 0);
    const int j = topology.edges(e, 1);
    const Vector3 along = at(x, i) - at(x, j);
    const double length = std::max(along.norm(), 1e-12);
    const double rest = model.lengths[e];
    const Vector3 unit = along / length;
    const Matrix3 outer = unit * unit.transpose();
    Matrix3 block = stiffness(terms, length, rest) * model.edge_areas[e] / (rest * rest) *
                    (outer + std::max(0.0, 1 - rest / length) * (Matrix3::Identity() - outer));
    if (terms.edge_weights.size() > 0) {
      block.diagonal().array() += terms.edge_weights[e];
    }
    state.add_diagonal(i, block);
    state.add_diagonal(j, block);
    state.add_block(state.edge_places[static_cast<std::size_t>(e)], i, j, -block);
  }
  if (terms.bend > 0) {
    constexpr std::array<std::array<int, 2>, 5> kPairs = {{{0, 1}, {0, 2}, {1, 2}, {0, 3}, {1, 3}}};
    for (Index h = 0; h < model.hinges.rows(); ++h) {
      const auto hinge = static_cast<std::size_t>(h);
      const auto product = [&](int i, int j) -> Matrix3 {
        return terms.bend * model.hinge_weights(h, i) * model.hinge_weights(h, j) *
               Matrix3::Identity();
      };
      for (int k = 0; k < 4; ++k) {
        state.add_diagonal(model.hinges(h, k), product(k, k));
      }
      for (std::size_t p = 0; p < kPairs.size(); ++p) {
        const auto& pair = kPairs[p];
        const auto edge = static_cast<std::size_t>(state.hinge_edges[hinge][p]);
        state.add_block(state.edge_places[edge], model.hinges(h, pair[0]), model.hinges(h, pair[1]),
                        product(pair[0], pair[1]));
      }
      state.add_block(state.apex_places[hinge], model.hinges(h, 2), model.hinges(h, 3),
                      product(2, 3));
    }
  }
  for (Index v = 0; v < terms.anchor_weights.size(); ++v) {
    state.add_diagonal(static_cast<int>(v), terms.anchor_weights[v] * Matrix3::Identity());
  }
  // Where the block of two neighbours lies.
  const auto edge_between = [&](int a, int b) {
    const int low = std::min(a, b);
    const int high = std::max(a, b);
    const auto begin = topology.edges.data();
    Index first = 0;
    Index last = topology.edges.rows();
    while (first < last) {  // edges are in lexicographic order
      const Index middle = (first + last) / 2;
      const int* edge = begin + 2 * middle;
      if (edge[0] < low || (edge[0] == low && edge[1] < high)) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    ATELIER_CHECK(first < topology.edges.rows() && topology.edges(first, 0) == low &&
                      topology.edges(first, 1) == high,
                  "a row over vertices of no face");
    return static_cast<std::size_t>(first);
  };
  for (const SurfaceRow& row : terms.rows) {
    const Matrix3 outer = row_weight(row, x) * row.normal * row.normal.transpose();
    if (row.vertices[0] == row.vertices[1]) {
      const double sum = row.barycentric.sum();
      state.add_diagonal(row.vertices[0], sum * sum * outer);
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      const int i = row.vertices[static_cast<std::size_t>(k)];
      const int j = row.vertices[static_cast<std::size_t>((k + 1) % 3)];
      state.add_diagonal(i, row.barycentric[k] * row.barycentric[k] * outer);
      state.add_block(state.edge_places[edge_between(i, j)], i, j,
                      row.barycentric[k] * row.barycentric[(k + 1) % 3] * outer);
    }
  }
  for (const FaceQuadratic& q : terms.quadratics) {
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const int i = topology.faces(q.face, k);
      const int j = topology.faces(q.face, next);
      state.add_diagonal(i, q.H.block<3, 3>(3 * k, 3 * k));
      state.add_block(state.edge_places[static_cast<std::size_t>(topology.face_edges(q.face, k))],
                      i, j, q.H.block<3, 3>(3 * k, 3 * next));
    }
  }
  return state.matrix;
}

Points ShapeSolver::lower(const ClothTerms& terms, const Points& x) {
  State& state = *state_;
  matrix(terms, x);
  double trace = 0;
  for (const auto& places : state.vertex_places) {
    trace += state.matrix.valuePtr()[places[0]];
  }
  // A garment that nothing holds, in the air, stays where it is.
  const double least = 1e-9 * trace / static_cast<double>(state.vertex_places.size());
  for (const auto& places : state.vertex_places) {
    for (const int place : places) {
      state.matrix.valuePtr()[place] += least;
    }
  }
  for (std::size_t i = 0; i < state.scalar_places.size(); ++i) {
    double sum = 0;
    for (const int place : state.scalar_places[i]) {
      sum += state.matrix.valuePtr()[place];
    }
    state.scalar.valuePtr()[i] = sum / 3;
  }
  Points moves;
  if (!state.solve(-0.5 * cloth_energy_gradient(state.model, terms, x), moves)) {
    return x;
  }
  const double before = cloth_energy(state.model, terms, x);
  ATELIER_CHECK(std::isfinite(before), "an energy that is a number");
  double share = 1;
  for (int i = 0; i < 6; ++i, share /= 2) {
    Points next = x + share * moves;
    if (next.allFinite() && cloth_energy(state.model, terms, next) < before) {
      return next;
    }
  }
  return x;
}

}  // namespace atelier
