#include "simulation/projective/anderson_acceleration.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/projective/anderson_math.h"

namespace atelier {
namespace {

constexpr Index kSumGrain = 2048;

}  // namespace

AndersonAcceleration::Products AndersonAcceleration::Products::operator+(
    const Products& other) const {
  Products out = *this;
  for (int k = 0; k < kMostWindow; ++k) {
    out.of_newest[k] += other.of_newest[k];
    out.of_change[k] += other.of_change[k];
  }
  out.size += other.size;
  return out;
}

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

AndersonAcceleration::Products AndersonAcceleration::note_difference(
    int slot, int count, const std::vector<Vec4<double>>& v,
    const std::vector<Vec4<double>>& change) {
  return parallel_sum(static_cast<Index>(v.size()), kSumGrain, Products{},
                      [&](Index begin, Index end) {
                        Products sum;
                        if (first_) {
                          for (Index i = begin; i < end; ++i) {
                            sum.size += dot(xyz(change[i]), xyz(change[i]));
                          }
                          return sum;
                        }
                        Difference& newest = differences_[slot];
                        for (Index i = begin; i < end; ++i) {
                          const Vec3d now = xyz(change[i]);
                          const Vec3d of_change = now - xyz(last_change_[i]);
                          const Vec3d of_next = xyz(v[i]) + now - xyz(last_next_[i]);
                          const auto single = [](Vec3d a) {
                            return Vec4<float>{static_cast<float>(a.x), static_cast<float>(a.y),
                                               static_cast<float>(a.z), 0};
                          };
                          newest.of_change[i] = single(of_change);
                          newest.of_next[i] = single(of_next);
                          sum.size += dot(now, now);
                          for (int k = 0; k < count; ++k) {
                            const Vec4<float>& other = differences_[k].of_change[i];
                            const Vec3d wide{other.x, other.y, other.z};
                            sum.of_newest[k] += dot(of_change, wide);
                            sum.of_change[k] += dot(now, wide);
                          }
                        }
                        return sum;
                      });
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
  const int slot = count_ == 0 ? 0 : (newest_ + 1) % window_;
  const int count = count_ < window_ ? count_ + 1 : window_;
  const Products products = note_difference(slot, count, v, change);
  const bool usable = anderson_usable(products.size, static_cast<double>(n));
  const bool anew = first_ || !usable || anderson_grew(products.size, least_);
  least_ = anew || products.size < least_ ? products.size : least_;
  Eigen::VectorXd shares(0);
  if (anew) {
    count_ = 0;
  } else {
    newest_ = slot;
    count_ = count;
    Eigen::MatrixXd matrix(count, count);
    shares.resize(count);
    for (int k = 0; k < count; ++k) {
      products_[slot][k] = products_[k][slot] = products.of_newest[k];
      shares[k] = products.of_change[k];
    }
    for (int k = 0; k < count; ++k) {
      for (int l = 0; l < count; ++l) {
        matrix(k, l) = products_[k][l];
      }
    }
    matrix.diagonal() *= kAndersonRidge;
    shares = matrix.ldlt().solve(shares).eval();
    if (!shares.allFinite()) {
      shares.resize(0);
      count_ = 0;
    }
  }
  first_ = !usable;
  for_all([&](Index i) {
    const Vec3d next = xyz(v[i]) + xyz(change[i]);
    Vec3d sum = next;
    for (Index k = 0; k < shares.size(); ++k) {
      const Vec4<float>& of = differences_[k].of_next[i];
      sum -= shares[k] * Vec3d{of.x, of.y, of.z};
    }
    last_change_[i] = change[i];
    last_next_[i] = with_w(next, 0.0);
    v[i] = with_w(sum, 0.0);
  });
}

}  // namespace atelier
