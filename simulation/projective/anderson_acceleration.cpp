#include "simulation/projective/anderson_acceleration.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kSumGrain = 2048;

double product(const std::vector<Vec4<double>>& a, const std::vector<Vec4<double>>& b) {
  return parallel_sum(static_cast<Index>(a.size()), kSumGrain, 0.0, [&](Index begin, Index end) {
    double sum = 0;
    for (Index i = begin; i < end; ++i) {
      sum += dot(xyz(a[i]), xyz(b[i]));
    }
    return sum;
  });
}

}  // namespace

void AndersonAcceleration::begin(std::size_t size, int window) {
  ATELIER_CHECK(window >= 0 && window <= kMostWindow, "a window of Anderson's acceleration");
  window_ = window;
  count_ = 0;
  newest_ = 0;
  first_ = true;
  differences_.resize(static_cast<std::size_t>(window));
  last_change_.resize(size);
  last_next_.resize(size);
  for (Difference& difference : differences_) {
    difference.of_change.resize(size);
    difference.of_next.resize(size);
  }
}

void AndersonAcceleration::advance(std::vector<Vec4<double>>& v,
                                   const std::vector<Vec4<double>>& change) {
  const Index n = static_cast<Index>(v.size());
  const auto for_all = [&](const auto& work) {
    parallel_for(n, kSumGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        work(i);
      }
    });
  };
  if (window_ == 0) {
    for_all([&](Index i) { v[i] = with_w(xyz(v[i]) + xyz(change[i]), 0.0); });
    return;
  }
  const double size = product(change, change);
  constexpr double kRounding = 1e-13;  // m/s, mean of a particle's change
  constexpr double kGrowth = 4;        // squared
  const bool usable = size > kRounding * kRounding * static_cast<double>(n);
  if (!usable || (!first_ && size > kGrowth * least_)) {
    count_ = 0;
    first_ = true;
  }
  if (first_) {
    least_ = size;
  } else {
    least_ = size < least_ ? size : least_;
    newest_ = count_ == 0 ? 0 : (newest_ + 1) % window_;
    count_ = count_ < window_ ? count_ + 1 : window_;
    Difference& difference = differences_[newest_];
    for_all([&](Index i) {
      difference.of_change[i] = with_w(xyz(change[i]) - xyz(last_change_[i]), 0.0);
      difference.of_next[i] = with_w(xyz(v[i]) + xyz(change[i]) - xyz(last_next_[i]), 0.0);
    });
    for (int k = 0; k < count_; ++k) {
      products_[newest_][k] = products_[k][newest_] =
          product(difference.of_change, differences_[k].of_change);
    }
  }
  for_all([&](Index i) {
    last_change_[i] = change[i];
    last_next_[i] = v[i] = with_w(xyz(v[i]) + xyz(change[i]), 0.0);
  });
  first_ = !usable;
  if (count_ == 0) {
    return;
  }
  Eigen::MatrixXd matrix(count_, count_);
  Eigen::VectorXd right(count_);
  for (int k = 0; k < count_; ++k) {
    right[k] = product(change, differences_[k].of_change);
    for (int l = 0; l < count_; ++l) {
      matrix(k, l) = products_[k][l];
    }
  }
  // Differences that are nearly combinations of others tell nothing.
  matrix.diagonal() *= 1 + 1e-10;
  const Eigen::VectorXd shares = matrix.ldlt().solve(right);
  if (!shares.allFinite()) {
    count_ = 0;
    return;
  }
  for_all([&](Index i) {
    Vec3d sum = xyz(v[i]);
    for (int k = 0; k < count_; ++k) {
      sum -= shares[k] * xyz(differences_[k].of_next[i]);
    }
    v[i] = with_w(sum, 0.0);
  });
}

}  // namespace atelier
