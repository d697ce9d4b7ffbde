#include "registration/outlines/symmetric_outlines.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "registration/outlines/alike_outlines.h"
#include "registration/outlines/outline_measures.h"

namespace atelier {
namespace {

/// A closed line by the share of its length, from its first point on.
struct ClosedLine {
  const Points2& points;
  std::vector<double> at{0};  // [N+1] shares

  explicit ClosedLine(const Points2& line) : points(line) {
    for (Index i = 0; i < line.rows(); ++i) {
      at.push_back(at.back() + (line.row((i + 1) % line.rows()) - line.row(i)).norm());
    }
    for (double& share : at) {
      share /= std::max(at.back(), 1e-12);
    }
    at.back() = 1;
  }

  Eigen::RowVector2d point(double share) const {
    share -= std::floor(share);
    const auto next = std::upper_bound(at.begin() + 1, at.end() - 1, share);
    const auto i = static_cast<Index>(next - at.begin()) - 1;
    const double from = at[static_cast<std::size_t>(i)];
    const double span = *next - from;
    const double t = span > 0 ? (share - from) / span : 0;
    return (1 - t) * points.row(i) + t * points.row((i + 1) % points.rows());
  }

  Eigen::RowVector2d nearest(const Eigen::RowVector2d& to) const {
    Eigen::RowVector2d best = points.row(0);
    double least = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < points.rows(); ++i) {
      const Eigen::RowVector2d a = points.row(i);
      const Eigen::RowVector2d ab = points.row((i + 1) % points.rows()) - a;
      const double t = std::clamp((to - a).dot(ab) / std::max(ab.squaredNorm(), 1e-18), 0.0, 1.0);
      const Eigen::RowVector2d on = a + t * ab;
      if ((on - to).squaredNorm() < least) {
        least = (on - to).squaredNorm();
        best = on;
      }
    }
    return best;
  }
};

/// Corners of the other line in the order of this line's, so that each lies near its own; empty
/// where there are no such.
std::vector<double> paired_corners(const ClosedLine& line, const std::vector<double>& corners,
                                   const ClosedLine& other, const std::vector<double>& theirs,
                                   double apart) {
  const std::size_t count = corners.size();
  if (count < 2 || theirs.size() != count) {
    return {};
  }
  for (std::size_t shift = 0; shift < count; ++shift) {
    bool near = true;
    for (std::size_t i = 0; i < count && near; ++i) {
      near = (line.point(corners[i]) - other.point(theirs[(i + shift) % count])).norm() < apart;
    }
    if (near) {
      std::vector<double> paired(theirs);
      std::rotate(paired.begin(), paired.begin() + static_cast<std::ptrdiff_t>(shift),
                  paired.end());
      return paired;
    }
  }
  return {};
}

/// The mean of an outline and the image that lies on it.
Points2 mean_outline(const Points2& outline, const Points2& image, double most) {
  constexpr double kCornersApart = 4;  // times `most`
  const ClosedLine line(outline);
  const ClosedLine other(image);
  const std::vector<double> corners = corner_shares(outline);
  const std::vector<double> paired =
      paired_corners(line, corners, other, corner_shares(image), kCornersApart * most);
  Points2 mean = outline;
  for (Index i = 0; i < outline.rows(); ++i) {
    const Eigen::RowVector2d here = outline.row(i);
    if (paired.empty()) {
      mean.row(i) = (here + other.nearest(here)) / 2;
      continue;
    }
    const double at = line.at[static_cast<std::size_t>(i)];
    const auto after = std::upper_bound(corners.begin(), corners.end(), at);
    const auto next = static_cast<std::size_t>(after - corners.begin()) % corners.size();
    const std::size_t before = (next + corners.size() - 1) % corners.size();
    const auto span = [](double from, double to) { return to > from ? to - from : to - from + 1; };
    const auto past = [](double from, double to) { return to >= from ? to - from : to - from + 1; };
    const double share = past(corners[before], at) / span(corners[before], corners[next]);
    mean.row(i) =
        (here + other.point(paired[before] + share * span(paired[before], paired[next]))) / 2;
  }
  return mean;
}

/// One round of means.
std::vector<Points2> nearer_to_images(const std::vector<Points2>& outlines, double most) {
  const std::size_t count = outlines.size();
  std::vector<std::size_t> mate(count, count);
  std::vector<Points2> images(count);
  const std::vector<std::vector<std::size_t>> alike = alike_outlines(outlines);
  for (std::size_t p = 0; p < count; ++p) {
    // What is small is not to become what it is not.
    constexpr double kShare = 0.05;  // of the side of a square as large
    double least = std::min(most, kShare * std::sqrt(std::abs(area_of_outline(outlines[p]))));
    const auto compare = [&](std::size_t q) {
      MirrorMatch match = mirror_match(outlines[q], outlines[p]);
      if (match.off <= least) {
        least = match.off;
        mate[p] = q;
        images[p] = std::move(match.image);
      }
    };
    compare(p);
    for (const std::size_t q : alike[p]) {
      compare(q);
    }
  }
  std::vector<Points2> result = outlines;
  for (std::size_t p = 0; p < count; ++p) {
    if (mate[p] < count && mate[mate[p]] == p) {
      result[p] = mean_outline(outlines[p], images[p], most);
    }
  }
  return result;
}

}  // namespace

std::vector<Points2> symmetric_outlines(const std::vector<Points2>& outlines, double most) {
  constexpr int kRounds = 2;  // the second about lines that the first has made clearer
  std::vector<Points2> result = outlines;
  for (int round = 0; round < kRounds; ++round) {
    result = nearer_to_images(result, most);
  }
  return result;
}

}  // namespace atelier
