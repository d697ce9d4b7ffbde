#include "registration/flattening/woven_shape.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/cross.h"
#include "core/error.h"
#include "registration/flattening/grain_direction.h"

namespace atelier {
namespace {

constexpr double kThreadWeight = 50;
constexpr double kStiffest = 30;       // times as stiff: what stretches far beyond `even`
constexpr double kLengthReach = 0.05;  // m of cloth that holds an edge's length
constexpr double kLeastArea = 0.3;     // of a face's: sheared further it would be a sliver

/// A face in its own plane.
struct FaceFrame {
  Eigen::Matrix2d to_gradient;  ///< its flat edges times this are the map's gradient
  double area = 0;
};

std::vector<FaceFrame> face_frames(const Points& vertices, const Triangles& faces) {
  std::vector<FaceFrame> frames(static_cast<std::size_t>(faces.rows()));
  for (Index f = 0; f < faces.rows(); ++f) {
    const Eigen::Vector3d a = vertices.row(faces(f, 0));
    const Eigen::Vector3d ab = vertices.row(faces(f, 1)).transpose() - a;
    const Eigen::Vector3d ac = vertices.row(faces(f, 2)).transpose() - a;
    const Eigen::Vector3d along = ab.normalized();
    const Eigen::Vector3d across = (ac - ac.dot(along) * along).normalized();
    Eigen::Matrix2d edges;
    edges << ab.norm(), ac.dot(along), 0, ac.dot(across);
    frames[static_cast<std::size_t>(f)] = {edges.inverse(), edges.determinant() / 2};
  }
  return frames;
}

Eigen::Matrix2d flat_edges(const Points2& flat, const Triangles& faces, Index f) {
  Eigen::Matrix2d edges;
  edges.col(0) = (flat.row(faces(f, 1)) - flat.row(faces(f, 0))).transpose();
  edges.col(1) = (flat.row(faces(f, 2)) - flat.row(faces(f, 0))).transpose();
  return edges;
}

/// The linear systems of both coordinates, which have the same entries: their places and the order
/// of elimination are found once for all iterations.
class ThreadSystem {
 public:
  ThreadSystem(const Triangles& faces, const std::vector<EdgeLength>& lengths, Index count)
      : right_(Eigen::VectorXd::Zero(count)) {
    std::vector<Eigen::Triplet<double>> entries{{0, 0, 1.0}};
    const auto couple = [&](int a, int b) {
      entries.emplace_back(std::max(a, b), std::min(a, b), 1);
    };
    for (Index f = 0; f < faces.rows(); ++f) {
      for (int i = 0; i < 3; ++i) {
        couple(faces(f, i), faces(f, i));
        couple(faces(f, i), faces(f, (i + 1) % 3));
      }
    }
    for (const EdgeLength& edge : lengths) {
      couple(edge.a, edge.b);
    }
    system_.resize(count, count);
    system_.setFromTriplets(entries.begin(), entries.end());
    solver_.analyzePattern(system_);
    for (Index f = 0; f < faces.rows(); ++f) {
      places_.push_back(places_of({faces(f, 1), faces(f, 2), faces(f, 0)}));
    }
    for (const EdgeLength& edge : lengths) {
      edge_places_.push_back(places_of({edge.b, edge.b, edge.a}));
    }
  }

  void clear() {
    std::fill_n(system_.valuePtr(), system_.nonZeros(), 0);
    right_.setZero();
  }

  /// weight * (sum of shares[i] * (x[i] - x[2]) - value)^2 over the corners 1, 2 and 0 of a face.
  void add_face(Index f, const Eigen::Vector2d& shares, double value, double weight) {
    add(places_[static_cast<std::size_t>(f)], shares, value, weight);
  }
  /// weight * (x[b] - x[a] - value)^2 of an edge, whose places are b, b and a.
  void add_edge(std::size_t edge, double value, double weight) {
    add(edge_places_[edge], {1, 0}, value, weight);
  }
  /// weight * (x[0] - value)^2
  void hold_first(double value, double weight) {
    system_.coeffRef(0, 0) += weight;
    right_[0] += weight * value;
  }

  /// False where it cannot be solved.
  bool solve(Eigen::VectorXd& solution) {
    solver_.factorize(system_);
    if (solver_.info() != Eigen::Success) {
      return false;
    }
    solution = solver_.solve(right_);
    return solution.allFinite();
  }

 private:
  struct Places {
    std::array<int, 3> at{};
    std::array<Index, 6> entries{};  // of values: 00, 11, 22, 01, 12, 20
  };

  Places places_of(const std::array<int, 3>& at) const {
    Places places{at, {}};
    for (std::size_t i = 0; i < 3; ++i) {
      places.entries[i] = entry_of(at[i], at[i]);
      places.entries[3 + i] = entry_of(at[i], at[(i + 1) % 3]);
    }
    return places;
  }
  Index entry_of(int a, int b) const {
    const int* rows = system_.innerIndexPtr();
    const int* begin = rows + system_.outerIndexPtr()[std::min(a, b)];
    const int* end = rows + system_.outerIndexPtr()[std::min(a, b) + 1];
    return std::lower_bound(begin, end, std::max(a, b)) - rows;
  }
  void add(const Places& places, const Eigen::Vector2d& shares, double value, double weight) {
    const std::array<double, 3> factors{shares[0], shares[1], -shares[0] - shares[1]};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = (i + 1) % 3;
      system_.valuePtr()[places.entries[i]] += weight * factors[i] * factors[i];
      system_.valuePtr()[places.entries[3 + i]] += weight * factors[i] * factors[k];
      right_[places.at[i]] += weight * factors[i] * value;
    }
  }

  Eigen::SparseMatrix<double> system_;  // the lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  Eigen::VectorXd right_;
  std::vector<Places> places_, edge_places_;
};

/// Where the threads would lie with their lengths; none where that cannot be solved.
Points2 with_threads(ThreadSystem& system, const Triangles& faces,
                     const std::vector<FaceFrame>& frames, const Points2& flat,
                     const WovenShapeOptions& options, const std::vector<EdgeLength>& lengths) {
  Points2 result(flat.rows(), 2);
  for (int axis = 0; axis < 2; ++axis) {
    system.clear();
    for (Index f = 0; f < faces.rows(); ++f) {
      const FaceFrame& frame = frames[static_cast<std::size_t>(f)];
      const Eigen::Matrix2d gradient = flat_edges(flat, faces, f) * frame.to_gradient;
      const double angle =
          std::atan2(gradient(1, 0) - gradient(0, 1), gradient(0, 0) + gradient(1, 1));
      const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(angle).toRotationMatrix();
      for (int k = 0; k < 2; ++k) {
        system.add_face(f, frame.to_gradient.col(k), rotation(axis, k), frame.area);
      }
      const Eigen::Vector2d thread = gradient.inverse().col(axis);  // of unit length when flat
      const double stretch = thread.norm() - 1;
      const double stiffer = std::min(std::pow(stretch / options.even, 2), kStiffest);
      system.add_face(f, frame.to_gradient * thread.normalized(), 1,
                      kThreadWeight * (1 + stiffer) * frame.area);
    }
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const EdgeLength& edge = lengths[i];
      const Eigen::RowVector2d along = (flat.row(edge.b) - flat.row(edge.a)).normalized();
      system.add_edge(i, edge.length * along[axis],
                      options.length_weight * kLengthReach / edge.length);
    }
    system.hold_first(flat(0, axis), 1);
    Eigen::VectorXd solution;
    if (!system.solve(solution)) {
      return {};
    }
    result.col(axis) = solution;
  }
  return result;
}

bool keeps_faces(const Points2& flat, const Triangles& faces,
                 const std::vector<FaceFrame>& frames) {
  for (Index f = 0; f < faces.rows(); ++f) {
    if (!(flat_edges(flat, faces, f).determinant() >
          2 * kLeastArea * frames[static_cast<std::size_t>(f)].area)) {
      return false;
    }
  }
  return true;
}

}  // namespace

double thread_strain(const Eigen::Matrix<double, 3, 2>& deformation) {
  return (deformation.colwise().norm().array() - 1).abs().maxCoeff();
}

Points2 woven_shape(const Points& vertices, const Triangles& faces, const Points2& start,
                    const WovenShapeOptions& options, const std::vector<EdgeLength>& lengths) {
  ATELIER_CHECK(start.rows() == vertices.rows(), "a start of as many vertices");
  const std::vector<FaceFrame> frames = face_frames(vertices, faces);
  // What turns a panel that its grain turns back is no progress: shapes are compared in their
  // grain.
  Points2 flat = turned_to_grain(vertices, faces, start);
  ThreadSystem system(faces, lengths, vertices.rows());
  for (int i = 0; i < options.iterations; ++i) {
    const Points2 next = with_threads(system, faces, frames, flat, options, lengths);
    if (next.rows() != flat.rows()) {
      break;
    }
    constexpr int kFullSteps = 2;
    constexpr int kHalvings = 6;
    // Threads that stiffen overshoot: full steps end in going to and fro.
    double share = i < kFullSteps ? 1 : 0.5;
    Points2 tried = flat + share * (next - flat);
    for (int k = 0; k < kHalvings && !keeps_faces(tried, faces, frames); ++k) {
      share /= 2;
      tried = flat + share * (next - flat);
    }
    if (!keeps_faces(tried, faces, frames)) {
      break;
    }
    tried = turned_to_grain(vertices, faces, tried);
    tried.rowwise() += (flat - tried).colwise().mean();
    const double moved = (tried - flat).rowwise().norm().maxCoeff();
    flat = tried;
    if (moved < options.still) {
      break;
    }
  }
  return flat;
}

}  // namespace atelier
