#include "registration/flattening/panel_energy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/cross.h"
#include "core/error.h"

namespace atelier {
namespace {

using Matrix2 = Eigen::Matrix2d;

constexpr int kPower = 3;   // n
constexpr double kEnd = 4;  // of x / b: twice the stretch

/// F = u diag(s) v', rotations u and v, s(0) >= s(1) > 0 where det F > 0.
struct Stretches {
  Matrix2 u, v;
  Eigen::Vector2d s;
};

Stretches stretches_of(const Matrix2& f) {
  // Closed form: F is a similarity plus an antisimilarity.
  const double e = (f(0, 0) + f(1, 1)) / 2;
  const double g = (f(0, 0) - f(1, 1)) / 2;
  const double h = (f(1, 0) + f(0, 1)) / 2;
  const double k = (f(1, 0) - f(0, 1)) / 2;
  const double turning = std::hypot(e, k);
  const double stretching = std::hypot(g, h);
  const double plus = std::atan2(k, e);
  const double minus = std::atan2(h, g);
  const double right = (minus - plus) / 2;
  const double left = (minus + plus) / 2;
  const auto rotation = [](double angle) {
    Matrix2 r;
    r << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    return r;
  };
  return {rotation(left), rotation(right), {turning + stretching, turning - stretching}};
}

/// Symmetric Dirichlet energy of the stretches, and its derivative.
double dirichlet(const Eigen::Vector2d& s) {
  return (s.squaredNorm() + s.cwiseInverse().squaredNorm()) / 2;
}
Eigen::Vector2d dirichlet_slope(const Eigen::Vector2d& s) {
  return s.array() - s.array().cube().inverse();
}

}  // namespace

PanelEnergy::PanelEnergy(const Points& vertices, const Triangles& faces,
                         std::vector<EdgeLength> lengths, double length_weight, double even)
    : faces_(faces),
      lengths_(std::move(lengths)),
      length_weight_(even > 0 ? (1 + std::pow(kEnd, kPower)) * length_weight : length_weight),
      soft_(2 * even * even) {
  const Index count = faces.rows();
  weights_.resize(count);
  gradients_.resize(static_cast<std::size_t>(count));
  for (Index f = 0; f < count; ++f) {
    const Eigen::Vector3d a = vertices.row(faces(f, 0));
    const Eigen::Vector3d ab = vertices.row(faces(f, 1)).transpose() - a;
    const Eigen::Vector3d ac = vertices.row(faces(f, 2)).transpose() - a;
    const double length = ab.norm();
    const double height = ab.cross(ac).norm() / length;
    const double along = ab.dot(ac) / length;
    weights_[f] = length * height / 2;
    Matrix2 inverse;  // of the columns (length, 0), (along, height)
    inverse << 1 / length, -along / (length * height), 0, 1 / height;
    gradients_[static_cast<std::size_t>(f)].bottomRows<2>() = inverse;
    gradients_[static_cast<std::size_t>(f)].row(0) = -inverse.colwise().sum();
  }
  area_ = weights_.sum();
  weights_ /= area_;

  std::vector<Eigen::Triplet<double>> pattern;
  const auto pairs = [&](const auto& ends) {
    for (const int i : ends) {
      for (const int j : ends) {
        for (int p = 0; p < 2; ++p) {
          for (int q = 0; q < 2; ++q) {
            if (2 * i + p >= 2 * j + q) {
              pattern.emplace_back(2 * i + p, 2 * j + q, 0);
            }
          }
        }
      }
    }
  };
  for (Index f = 0; f < count; ++f) {
    pairs(std::array{faces(f, 0), faces(f, 1), faces(f, 2)});
  }
  for (const EdgeLength& edge : lengths_) {
    pairs(std::array{edge.a, edge.b});
  }
  hessian_.resize(2 * vertices.rows(), 2 * vertices.rows());
  hessian_.setFromTriplets(pattern.begin(), pattern.end());
  hessian_.makeCompressed();
  const auto place = [&](int row, int column) {
    if (row < column) {
      return -1;
    }
    const int* begin = hessian_.innerIndexPtr() + hessian_.outerIndexPtr()[column];
    const int* end = hessian_.innerIndexPtr() + hessian_.outerIndexPtr()[column + 1];
    return static_cast<int>(std::lower_bound(begin, end, row) - hessian_.innerIndexPtr());
  };
  face_places_.resize(static_cast<std::size_t>(count));
  for (Index f = 0; f < count; ++f) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        face_places_[static_cast<std::size_t>(f)](i, j) =
            place(2 * faces(f, i / 2) + i % 2, 2 * faces(f, j / 2) + j % 2);
      }
    }
  }
  for (const EdgeLength& edge : lengths_) {
    const std::array ends{edge.a, edge.b};
    Eigen::Matrix<int, 4, 4>& places = edge_places_.emplace_back();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        places(i, j) = place(2 * ends[static_cast<std::size_t>(i / 2)] + i % 2,
                             2 * ends[static_cast<std::size_t>(j / 2)] + j % 2);
      }
    }
  }
  for (int i = 0; i < 2 * static_cast<int>(vertices.rows()); ++i) {
    diagonal_places_.push_back(place(i, i));
  }
}

PanelEnergy::Corners PanelEnergy::corners(const Eigen::VectorXd& x, Index face) const {
  Corners corners;
  for (int k = 0; k < 3; ++k) {
    corners.col(k) = x.segment<2>(2 * faces_(face, k));
  }
  return corners;
}

double PanelEnergy::dirichlet_at(const Eigen::VectorXd& x, Index face) const {
  const Matrix2 deformation = corners(x, face) * gradients_[static_cast<std::size_t>(face)];
  const double determinant = deformation.determinant();
  if (!(determinant > 0)) {
    return std::numeric_limits<double>::infinity();
  }
  // s1^2 + s2^2 = |F|^2, and their inverses' the same over det^2.
  return deformation.squaredNorm() * (1 + 1 / (determinant * determinant)) / 2;
}

PanelEnergy::Stiffened PanelEnergy::stiffened(double d) const {
  if (!(soft_ > 0)) {
    return {d, 1, 0};
  }
  const double x = std::max(0.0, d - 2) / soft_;
  const double bent = std::min(x, kEnd);
  const double stiff = std::pow(bent, kPower);
  const double beyond = x > kEnd ? (x - kEnd) * stiff : 0;
  return {d + soft_ * (stiff * bent / (kPower + 1) + beyond), 1 + stiff,
          x > kEnd ? 0 : kPower * std::pow(bent, kPower - 1) / soft_};
}

double PanelEnergy::value(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (Index f = 0; f < faces_.rows(); ++f) {
    const double d = dirichlet_at(x, f);
    if (std::isinf(d)) {
      return d;
    }
    sum += weights_[f] * stiffened(d).value;
  }
  for (const EdgeLength& edge : lengths_) {
    const double length = (x.segment<2>(2 * edge.b) - x.segment<2>(2 * edge.a)).norm();
    sum += length_weight_ / area_ * (length - edge.length) * (length - edge.length) / 2;
  }
  return sum;
}

double PanelEnergy::stretching(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (Index f = 0; f < faces_.rows(); ++f) {
    sum += weights_[f] * dirichlet_at(x, f);
  }
  return sum;
}

Eigen::VectorXd PanelEnergy::gradient(const Eigen::VectorXd& x) const {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(x.size());
  for (Index f = 0; f < faces_.rows(); ++f) {
    const auto& g = gradients_[static_cast<std::size_t>(f)];
    const Stretches at = stretches_of(corners(x, f) * g);
    const Matrix2 stress = at.u * dirichlet_slope(at.s).asDiagonal() * at.v.transpose();
    const Corners forces = weights_[f] * stiffened(dirichlet(at.s)).slope * stress * g.transpose();
    for (int k = 0; k < 3; ++k) {
      gradient.segment<2>(2 * faces_(f, k)) += forces.col(k);
    }
  }
  for (const EdgeLength& edge : lengths_) {
    const Eigen::Vector2d along = x.segment<2>(2 * edge.b) - x.segment<2>(2 * edge.a);
    const double length = along.norm();
    const Eigen::Vector2d force =
        length_weight_ / area_ * (length - edge.length) / std::max(length, 1e-12) * along;
    gradient.segment<2>(2 * edge.b) += force;
    gradient.segment<2>(2 * edge.a) -= force;
  }
  return gradient;
}

const Eigen::SparseMatrix<double>& PanelEnergy::hessian(const Eigen::VectorXd& x) {
  double* values = hessian_.valuePtr();
  std::fill(values, values + hessian_.nonZeros(), 0.0);
  for (Index f = 0; f < faces_.rows(); ++f) {
    const auto& g = gradients_[static_cast<std::size_t>(f)];
    const Stretches at = stretches_of(corners(x, f) * g);
    const double s1 = at.s[0];
    const double s2 = at.s[1];
    // The four eigenpairs: both stretches, twist and flip.
    Matrix2 twist;
    twist << 0, -1, 1, 0;
    Matrix2 flip;
    flip << 0, 1, 1, 0;
    const double cubes = s1 * s1 * s1 * s2 * s2 * s2;
    const std::array<double, 4> eigenvalues = {
        1 + 3 / (s1 * s1 * s1 * s1), 1 + 3 / (s2 * s2 * s2 * s2),
        1 - (s1 * s1 - s1 * s2 + s2 * s2) / cubes, 1 + (s1 * s1 + s1 * s2 + s2 * s2) / cubes};
    const std::array<Matrix2, 4> modes = {Matrix2(at.u.col(0) * at.v.col(0).transpose()),
                                          Matrix2(at.u.col(1) * at.v.col(1).transpose()),
                                          Matrix2(at.u * twist * at.v.transpose() / std::sqrt(2.0)),
                                          Matrix2(at.u * flip * at.v.transpose() / std::sqrt(2.0))};
    const Stiffened stiff = stiffened(dirichlet(at.s));
    Eigen::Matrix<double, 6, 6> part = Eigen::Matrix<double, 6, 6>::Zero();
    const auto add = [&](const Matrix2& mode, double stiffness) {
      const Corners moved = mode * g.transpose();
      const Eigen::Map<const Eigen::Matrix<double, 6, 1>> direction(moved.data());
      part += weights_[f] * stiffness * direction * direction.transpose();
    };
    for (std::size_t mode = 0; mode < 4; ++mode) {
      if (eigenvalues[mode] > 0) {
        add(modes[mode], stiff.slope * eigenvalues[mode]);
      }
    }
    add(at.u * dirichlet_slope(at.s).asDiagonal() * at.v.transpose(), stiff.bend);
    const auto& places = face_places_[static_cast<std::size_t>(f)];
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        if (places(i, j) >= 0) {
          values[places(i, j)] += part(i, j);
        }
      }
    }
  }
  for (std::size_t e = 0; e < lengths_.size(); ++e) {
    const EdgeLength& edge = lengths_[e];
    const Eigen::Vector2d along = x.segment<2>(2 * edge.b) - x.segment<2>(2 * edge.a);
    const double length = std::max(along.norm(), 1e-12);
    const Eigen::Vector2d unit = along / length;
    const Matrix2 outer = unit * unit.transpose();
    const Matrix2 block =
        length_weight_ / area_ *
        (outer + std::max(0.0, 1 - edge.length / length) * (Matrix2::Identity() - outer));
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        if (edge_places_[e](i, j) >= 0) {
          values[edge_places_[e](i, j)] += (i / 2 == j / 2 ? 1 : -1) * block(i % 2, j % 2);
        }
      }
    }
  }
  double trace = 0;
  for (const int at : diagonal_places_) {
    trace += values[at];
  }
  for (const int at : diagonal_places_) {
    values[at] += 1e-9 * trace / static_cast<double>(diagonal_places_.size());
  }
  return hessian_;
}

double PanelEnergy::longest_step(const Eigen::VectorXd& x, const Eigen::VectorXd& d) const {
  double longest = std::numeric_limits<double>::infinity();
  for (Index f = 0; f < faces_.rows(); ++f) {
    const Corners from = corners(x, f);
    const Corners by = corners(d, f);
    const Eigen::Vector2d p = from.col(1) - from.col(0);
    const Eigen::Vector2d q = from.col(2) - from.col(0);
    const Eigen::Vector2d dp = by.col(1) - by.col(0);
    const Eigen::Vector2d dq = by.col(2) - by.col(0);
    // Twice the area after a step t: c + b t + a t^2, its smallest positive root.
    const double a = cross(dp, dq);
    const double b = cross(p, dq) + cross(dp, q);
    const double c = cross(p, q);
    const double inside = b * b - 4 * a * c;
    if (inside < 0) {
      continue;
    }
    const double root = -(b + std::copysign(std::sqrt(inside), b)) / 2;
    for (const double t : {a != 0 ? root / a : -1, root != 0 ? c / root : -1}) {
      if (t > 0) {
        longest = std::min(longest, t);
      }
    }
  }
  return std::min(1.0, 0.9 * longest);
}

}  // namespace atelier
