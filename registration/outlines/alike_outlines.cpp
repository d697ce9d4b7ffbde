#include "registration/outlines/alike_outlines.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "registration/outlines/outline_measures.h"

namespace atelier {
namespace {

/// Root of the area, a quarter of the perimeter, radii of gyration, m.
Eigen::Vector4d invariant_lengths(const Points2& outline) {
  const Index count = outline.rows();
  double perimeter = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (Index i = 0; i < count; ++i) {
    const Eigen::Vector2d a = outline.row(i);
    const Eigen::Vector2d b = outline.row((i + 1) % count);
    const Eigen::Vector2d middle = (a + b) / 2;
    const Eigen::Vector2d along = b - a;
    const double length = along.norm();
    perimeter += length;
    first += length * middle;
    second += length * (middle * middle.transpose() + along * along.transpose() / 12);
  }
  perimeter = std::max(perimeter, 1e-12);
  first /= perimeter;
  second = second / perimeter - first * first.transpose();
  const double mean = second.trace() / 2;
  const double apart = std::hypot((second(0, 0) - second(1, 1)) / 2, second(0, 1));
  return {std::sqrt(std::abs(area_of_outline(outline))), perimeter / 4,
          std::sqrt(std::max(0.0, mean + apart)), std::sqrt(std::max(0.0, mean - apart))};
}

}  // namespace

std::vector<std::vector<std::size_t>> alike_outlines(const std::vector<Points2>& outlines) {
  constexpr std::size_t kMost = 6;
  constexpr double kAreas = 1.3;
  std::vector<Eigen::Vector4d> lengths;
  for (const Points2& outline : outlines) {
    ATELIER_CHECK(outline.rows() >= 3, "an outline of three points or more");
    lengths.push_back(invariant_lengths(outline));
  }
  const double side = std::sqrt(kAreas);
  std::vector<std::vector<std::size_t>> alike(outlines.size());
  std::vector<std::pair<double, std::size_t>> others;
  for (std::size_t p = 0; p < outlines.size(); ++p) {
    others.clear();
    for (std::size_t q = 0; q < outlines.size(); ++q) {
      if (p != q && lengths[q][0] < side * lengths[p][0] && lengths[p][0] < side * lengths[q][0]) {
        others.emplace_back((lengths[p] - lengths[q]).squaredNorm(), q);
      }
    }
    const std::size_t count = std::min(kMost, others.size());
    std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                      others.end());
    for (std::size_t i = 0; i < count; ++i) {
      alike[p].push_back(others[i].second);
    }
  }
  return alike;
}

}  // namespace atelier
