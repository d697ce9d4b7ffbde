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
constexpr double kStill = 1e-5;        // m by which the last step moves

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

/// The linear system of one coordinate.
class AxisSystem {
 public:
  explicit AxisSystem(Index count) : count_(count), right_(Eigen::VectorXd::Zero(count)) {}

  /// weight * (sum of shares[i] * (x[at[i]] - x[at[2]]) - value)^2 over i = 0, 1
  void add(const std::array<int, 3>& at, const Eigen::Vector2d& shares, double value,
           double weight) {
    const std::array<double, 3> factors{shares[0], shares[1], -shares[0] - shares[1]};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        entries_.emplace_back(at[i], at[k], weight * factors[i] * factors[k]);
      }
      right_[at[i]] += weight * factors[i] * value;
    }
  }
  void hold(int vertex, double value, double weight) {
    entries_.emplace_back(vertex, vertex, weight);
    right_[vertex] += weight * value;
  }

  /// False where it cannot be solved.
  bool solve(Eigen::VectorXd& solution) const {
    Eigen::SparseMatrix<double> system(count_, count_);
    system.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
    if (solver.info() != Eigen::Success) {
      return false;
    }
    solution = solver.solve(right_);
    return solution.allFinite();
  }

 private:
  Index count_;
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd right_;
};

/// Where the threads would lie with their lengths; none where that cannot be solved.
Points2 with_threads(const Triangles& faces, const std::vector<FaceFrame>& frames,
                     const Points2& flat, const WovenShapeOptions& options,
                     const std::vector<EdgeLength>& lengths) {
  std::array<AxisSystem, 2> axes{AxisSystem(flat.rows()), AxisSystem(flat.rows())};
  for (Index f = 0; f < faces.rows(); ++f) {
    const FaceFrame& frame = frames[static_cast<std::size_t>(f)];
    const std::array<int, 3> at{faces(f, 1), faces(f, 2), faces(f, 0)};
    const Eigen::Matrix2d gradient = flat_edges(flat, faces, f) * frame.to_gradient;
    const Eigen::Matrix2d back = gradient.inverse();
    const double angle =
        std::atan2(gradient(1, 0) - gradient(0, 1), gradient(0, 0) + gradient(1, 1));
    const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(angle).toRotationMatrix();
    for (int axis = 0; axis < 2; ++axis) {
      AxisSystem& system = axes[static_cast<std::size_t>(axis)];
      for (int k = 0; k < 2; ++k) {
        system.add(at, frame.to_gradient.col(k), rotation(axis, k), frame.area);
      }
      const Eigen::Vector2d thread = back.col(axis);  // of unit length when laid flat
      const double stretch = thread.norm() - 1;
      const double stiffer = std::min(std::pow(stretch / options.even, 2), kStiffest);
      system.add(at, frame.to_gradient * thread.normalized(), 1,
                 kThreadWeight * (1 + stiffer) * frame.area);
    }
  }
  for (const EdgeLength& edge : lengths) {
    const Eigen::RowVector2d along = (flat.row(edge.b) - flat.row(edge.a)).normalized();
    const double weight = options.length_weight * kLengthReach / edge.length;
    for (int axis = 0; axis < 2; ++axis) {
      axes[static_cast<std::size_t>(axis)].add({edge.b, edge.b, edge.a}, {1, 0},
                                               edge.length * along[axis], weight);
    }
  }
  Points2 result(flat.rows(), 2);
  for (int axis = 0; axis < 2; ++axis) {
    axes[static_cast<std::size_t>(axis)].hold(0, flat(0, axis), 1);
    Eigen::VectorXd solution;
    if (!axes[static_cast<std::size_t>(axis)].solve(solution)) {
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
  Points2 flat = start;
  for (int i = 0; i < options.iterations; ++i) {
    flat = turned_to_grain(vertices, faces, flat);
    const Points2 next = with_threads(faces, frames, flat, options, lengths);
    if (next.rows() != flat.rows()) {
      break;
    }
    constexpr int kHalvings = 6;
    double share = 1;
    Points2 tried = next;
    for (int k = 0; k < kHalvings && !keeps_faces(tried, faces, frames); ++k) {
      share /= 2;
      tried = flat + share * (next - flat);
    }
    if (!keeps_faces(tried, faces, frames)) {
      break;
    }
    const double moved = (tried - flat).rowwise().norm().maxCoeff();
    flat = tried;
    if (moved < kStill) {
      break;
    }
  }
  return turned_to_grain(vertices, faces, flat);
}

}  // namespace atelier
