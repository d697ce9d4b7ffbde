#include "capture/radial_fit.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace atelier {
namespace {

/// Coefficients of u, u^2, ... with 1 in front, at u.
double polynomial_at(std::span<const double> coefficients, double u) {
  double sum = 0;
  for (auto k = coefficients.rbegin(); k != coefficients.rend(); ++k) {
    sum = u * (*k + sum);
  }
  return 1 + sum;
}

/// The undistorted radius whose image is at `reach`, or the last before the image turns back.
template <class Factor>
double last_radius(const Factor& factor, double reach) {
  constexpr int kSteps = 2000;
  constexpr double kLargestShrink = 4;  // a lens that shrinks more is none
  double before = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = kLargestShrink * reach * i / kSteps;
    const double image = r * factor(r * r);
    if (!(image > before)) {
      return kLargestShrink * reach * (i - 1) / kSteps;
    }
    if (image >= reach) {
      return r;
    }
    before = image;
  }
  return kLargestShrink * reach;
}

/// Squares of radii up to `last` in units of its square, in (0, 1].
std::vector<double> sampled_squares() {
  constexpr int kRadii = 64;
  std::vector<double> squares;
  for (int i = 0; i < kRadii; ++i) {
    squares.push_back(0.5 - 0.5 * std::cos(std::numbers::pi * (i + 0.5) / kRadii));
  }
  squares.push_back(1);
  return squares;
}

/// Solves the rows and takes the unit off: coefficient i of a block belongs to u^(i + 1).
std::vector<double> solved(const Eigen::MatrixXd& rows, const Eigen::VectorXd& right, double unit,
                           int block) {
  const Eigen::VectorXd scaled = rows.colPivHouseholderQr().solve(right);
  std::vector<double> coefficients;
  for (Eigen::Index i = 0; i < scaled.size(); ++i) {
    coefficients.push_back(scaled[i] / std::pow(unit, i % block + 1));
  }
  return coefficients;
}

template <class One, class Other>
double largest_error(const One& one, const Other& other, double last) {
  double largest = 0;
  constexpr int kSteps = 500;
  for (int i = 0; i <= kSteps; ++i) {
    const double r = last * i / kSteps;
    const double error = r * std::abs(one(r * r) - other(r * r));
    largest = std::isfinite(error) ? std::max(largest, error) : HUGE_VAL;
  }
  return largest;
}

}  // namespace

RadialFit rational_of_polynomial(std::span<const double> polynomial, double reach) {
  const auto factor = [&](double u) { return polynomial_at(polynomial, u); };
  const double last = last_radius(factor, reach);
  const double unit = last * last;
  const std::vector<double> squares = sampled_squares();
  // Numerator - factor * denominator = 0, linear in both.
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(squares.size()), 6);
  Eigen::VectorXd right(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const double s = squares[static_cast<std::size_t>(i)];
    const double value = factor(unit * s);
    rows.row(i) << s, s * s, s * s * s, -value * s, -value * s * s, -value * s * s * s;
    right[i] = value - 1;
  }
  RadialFit fit;
  fit.coefficients = solved(rows, right, unit, 3);
  const std::span<const double> all = fit.coefficients;
  fit.error = largest_error(
      factor,
      [&](double u) {
        const double below = polynomial_at(all.subspan(3), u);
        return below > 0 ? polynomial_at(all.first(3), u) / below : HUGE_VAL;
      },
      last);
  return fit;
}

RadialFit polynomial_of_rational(const Camera& camera, int count) {
  const auto& d = camera.distortion;
  const std::array<double, 3> above = {d[0], d[1], d[4]};
  const std::array<double, 3> below = {d[5], d[6], d[7]};
  const auto factor = [&](double u) { return polynomial_at(above, u) / polynomial_at(below, u); };
  const double last = last_radius(factor, corner_reach(camera));
  const double unit = last * last;
  const std::vector<double> squares = sampled_squares();
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(squares.size()), count);
  Eigen::VectorXd right(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const double s = squares[static_cast<std::size_t>(i)];
    // Weighted by the radius: what is off is a distance.
    for (int k = 0; k < count; ++k) {
      rows(i, k) = std::sqrt(s) * std::pow(s, k + 1);
    }
    right[i] = std::sqrt(s) * (factor(unit * s) - 1);
  }
  RadialFit fit;
  fit.coefficients = solved(rows, right, unit, count);
  fit.error = largest_error(
      factor, [&](double u) { return polynomial_at(fit.coefficients, u); }, last);
  return fit;
}

double corner_reach(const Camera& camera) {
  const auto side = [](int pixels, double center) {
    const double size = pixels > 0 ? pixels : center > 0 ? 2 * center : 1;
    return std::max(std::abs(center), std::abs(size - center));
  };
  // Where nothing is said of the size, focal lengths are in widths (capture/layouts/nerfstudio.h).
  return std::hypot(side(camera.width, camera.cx) / camera.fx,
                    side(camera.height, camera.cy) / camera.fy);
}

}  // namespace atelier
