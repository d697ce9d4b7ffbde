#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "simulation/xpbd/constraint_math.h"
#include "tests/simulation/cloth_fixtures.h"

/// Implicit Euler's own answer, for any solver.
namespace atelier::fixtures {

/// Elastic force on every particle (minus the gradient of the energy), stacked [3 V].
inline Eigen::VectorXd elastic_gradient(const Cloth& cloth, const Eigen::VectorXd& x) {
  const auto p = [&](int v) { return Vec3d{x[3 * v], x[3 * v + 1], x[3 * v + 2]}; };
  Eigen::VectorXd out = Eigen::VectorXd::Zero(x.size());
  const auto add = [&](int v, double factor, Vec3d g) {
    out[3 * v] += factor * g.x;
    out[3 * v + 1] += factor * g.y;
    out[3 * v + 2] += factor * g.z;
  };
  for (const ClothSpring& s : cloth.springs) {
    const SpringValue<double> value = spring_value(p(s.a), p(s.b), s.rest);
    add(s.a, s.stiffness * value.c, value.gradient);
    add(s.b, -s.stiffness * value.c, value.gradient);
  }
  for (const ClothHinge& h : cloth.hinges) {
    const int v[4] = {h.edge0, h.edge1, h.left, h.right};
    const HingeValue<double> value = hinge_value(p(v[0]), p(v[1]), p(v[2]), p(v[3]));
    for (int k = 0; k < 4; ++k) {
      add(v[k], h.stiffness * angle_difference(value.angle, h.rest), value.gradient[k]);
    }
  }
  return out;
}

/// One step of implicit Euler by Newton on the dense system, in double.
inline ClothState newton_step(const Cloth& cloth, const ClothState& state, double h) {
  const int n = static_cast<int>(cloth.mass.size());
  Eigen::VectorXd x(3 * n);
  Eigen::VectorXd goal(3 * n);
  Eigen::VectorXd mass(3 * n);
  std::vector<int> free;
  for (int v = 0; v < n; ++v) {
    for (int k = 0; k < 3; ++k) {
      x[3 * v + k] = state.positions(v, k);
      goal[3 * v + k] = state.positions(v, k) +
                        (cloth.fixed[v] ? 0 : h * state.velocities(v, k) - (k == 1) * h * h * 9.81);
      mass[3 * v + k] = cloth.mass[v] / (h * h);
      if (!cloth.fixed[v]) {
        free.push_back(3 * v + k);
      }
    }
  }
  const auto gradient = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    return mass.cwiseProduct(at - goal) + elastic_gradient(cloth, at);
  };
  const auto on_free = [&](const Eigen::VectorXd& all) {
    Eigen::VectorXd out(free.size());
    for (std::size_t i = 0; i < free.size(); ++i) {
      out[i] = all[free[i]];
    }
    return out;
  };
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Eigen::VectorXd g = on_free(gradient(x));
    if (g.norm() < 1e-11) {
      break;
    }
    Eigen::MatrixXd hessian(free.size(), free.size());
    for (std::size_t i = 0; i < free.size(); ++i) {
      Eigen::VectorXd plus = x;
      Eigen::VectorXd minus = x;
      plus[free[i]] += 1e-7;
      minus[free[i]] -= 1e-7;
      hessian.col(i) = on_free(gradient(plus) - gradient(minus)) / 2e-7;
    }
    const Eigen::VectorXd step = hessian.ldlt().solve(g);
    for (std::size_t i = 0; i < free.size(); ++i) {
      x[free[i]] -= step[i];
    }
  }
  ClothState out = state;
  for (int v = 0; v < n; ++v) {
    for (int k = 0; k < 3; ++k) {
      out.positions(v, k) = x[3 * v + k];
      out.velocities(v, k) = (x[3 * v + k] - state.positions(v, k)) / h;
    }
  }
  ++out.frame;
  return out;
}

}  // namespace atelier::fixtures
