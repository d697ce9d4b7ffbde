#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>

namespace atelier::fixtures {

/// Central differences of f at x: [rows of f, rows of x].
inline Eigen::MatrixXd finite_difference_jacobian(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& x,
    double step = 1e-6) {
  const Eigen::Index rows = f(x).size();
  Eigen::MatrixXd jacobian(rows, x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double h = step * std::max(1.0, std::abs(x[i]));
    Eigen::VectorXd plus = x;
    Eigen::VectorXd minus = x;
    plus[i] += h;
    minus[i] -= h;
    jacobian.col(i) = (f(plus) - f(minus)) / (plus[i] - minus[i]);
  }
  return jacobian;
}

/// |analytic - numeric| / max(1, |numeric|), the largest over all entries.
inline double jacobian_error(const Eigen::MatrixXd& analytic, const Eigen::MatrixXd& numeric) {
  return ((analytic - numeric).array().abs() / numeric.array().abs().max(1.0)).maxCoeff();
}

}  // namespace atelier::fixtures
