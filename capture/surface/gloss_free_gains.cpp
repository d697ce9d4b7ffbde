#include "capture/surface/gloss_free_gains.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/median.h"
#include "core/types.h"

namespace atelier {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kMinSaturation = 0.1;  // of a place that has colour: chroma over brightness
constexpr double kHold = 0.02;          // how far gloss may have put the given gains off
// Samples of a camera that count as independent: gloss and wrong places are alike nearby.
constexpr double kIndependent = 200;
constexpr std::size_t kMinSamples = 100;
constexpr int kGainRounds = 20;

/// Without the part along white.
Vector chroma(const Vector& color) {
  return color.array() - color.mean();
}

/// Colour that a place's samples agree on, less gains.
Vector middle_of(const std::vector<ColorSample>& place, const Eigen::MatrixX3d& gain) {
  Vector middle;
  std::vector<double> values;
  for (int k = 0; k < 3; ++k) {
    values.clear();
    for (const ColorSample& sample : place) {
      values.push_back(sample.color[k] / gain(sample.camera, k));
    }
    middle[k] = values.size() > 2 ? median(values) : 0.5 * (values.front() + values.back());
  }
  return middle;
}

}  // namespace

MeasuredGains gloss_free_gains(const std::vector<std::vector<ColorSample>>& places,
                               const MeasuredGains& first) {
  const Index cameras = first.gain.rows();
  const Index unknowns = 3 * cameras;  // relative changes of 1 / gain
  MeasuredGains result = first;
  Eigen::MatrixX3d& found = result.gain;
  double scale = 0.1;
  for (int round = 0; round < kGainRounds; ++round) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    std::vector<double> residuals;
    for (const std::vector<ColorSample>& place : places) {
      const Vector middle = middle_of(place, found);
      const Vector tint = chroma(middle);
      const double strength = tint.norm();
      if (strength < kMinSaturation * middle.norm()) {
        continue;
      }
      std::vector<double> weights;
      std::vector<Eigen::Matrix3d> slopes;
      std::vector<Vector> values;
      double sum = 0;
      Vector mean = Vector::Zero();
      for (const ColorSample& sample : place) {
        const Vector color = sample.color.cwiseQuotient(found.row(sample.camera).transpose());
        const Vector value = chroma(color) / strength;
        const double residual = (value - tint / strength).norm();
        residuals.push_back(residual);
        const double off = residual / (2.4 * scale);
        weights.push_back(sample.weight / (1 + off * off));
        values.push_back(value);
        Eigen::Matrix3d slope = (color / strength).asDiagonal();
        slope.rowwise() -= slope.colwise().mean().eval();
        slopes.push_back(slope);
        sum += weights.back();
        mean += weights.back() * value;
      }
      mean /= sum;
      for (std::size_t i = 0; i < place.size(); ++i) {
        const Index a = 3 * place[i].camera;
        const Eigen::Matrix3d weighted = weights[i] * slopes[i].transpose();
        right.segment<3>(a) += weighted * (mean - values[i]);
        normal.block<3, 3>(a, a) += weighted * slopes[i];
        for (std::size_t j = 0; j < place.size(); ++j) {
          normal.block<3, 3>(a, 3 * place[j].camera) -= weights[j] / sum * weighted * slopes[j];
        }
      }
    }
    if (residuals.size() < kMinSamples) {
      return first;
    }
    const double share = std::min(1.0, kIndependent * static_cast<double>(cameras) /
                                           static_cast<double>(residuals.size())) /
                         (scale * scale);
    normal *= share;
    right *= share;
    const double hold = 1 / (kHold * kHold);
    const double gauge = normal.trace() / static_cast<double>(unknowns) + hold;
    for (Index a = 0; a < cameras; ++a) {
      for (int k = 0; k < 3; ++k) {
        normal(3 * a + k, 3 * a + k) += hold;
        right[3 * a + k] += hold * std::log(found(a, k) / first.gain(a, k));
        for (Index b = 0; b < cameras; ++b) {
          normal(3 * a + k, 3 * b + k) += gauge;  // the mean stays where it is
        }
      }
    }
    const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
    const Eigen::VectorXd change = factor.solve(right);
    for (Index a = 0; a < cameras; ++a) {
      found.row(a).array() *= (-change.segment<3>(3 * a).array()).exp().transpose();
    }
    scale = std::max(1.4826 * median(residuals), 1e-4);
    if (change.cwiseAbs().maxCoeff() < 1e-9 || round + 1 == kGainRounds) {
      const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
      const Eigen::VectorXd deviation = inverse.diagonal().cwiseMax(0).cwiseSqrt();
      for (Index a = 0; a < cameras; ++a) {
        result.deviation.row(a) = deviation.segment<3>(3 * a).transpose();
      }
      break;
    }
  }
  for (int k = 0; k < 3; ++k) {
    found.col(k) /= std::exp(found.col(k).array().log().mean());
  }
  return result;
}

}  // namespace atelier
