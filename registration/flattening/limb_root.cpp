#include "registration/flattening/limb_root.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/angle_defects.h"
#include "core/neighbor_means.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kBinWidth = 0.01;  // m of distance from an opening

/// How long the loops at each distance from an opening are, m: at the middles of bins.
std::vector<double> loop_lengths(const Mesh& mesh, const std::vector<double>& distances) {
  std::vector<double> lengths;
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    std::array<double, 3> at{};
    for (int k = 0; k < 3; ++k) {
      at[static_cast<std::size_t>(k)] = distances[static_cast<std::size_t>(mesh.faces(f, k))];
    }
    const auto [low, high] = std::minmax_element(at.begin(), at.end());
    if (!std::isfinite(*high)) {
      continue;
    }
    const auto first = saturating_cast<int>(std::ceil(*low / kBinWidth - 0.5));
    const auto last = saturating_cast<int>(std::floor(*high / kBinWidth - 0.5));
    if (last >= 0) {
      lengths.resize(std::max(lengths.size(), static_cast<std::size_t>(last) + 1), 0);
    }
    for (int bin = std::max(0, first); bin <= last; ++bin) {
      const double level = (bin + 0.5) * kBinWidth;
      std::vector<Eigen::RowVector3d> ends;
      for (int k = 0; k < 3; ++k) {
        const double from = at[static_cast<std::size_t>(k)];
        const double to = at[static_cast<std::size_t>((k + 1) % 3)];
        if ((from < level) != (to < level)) {
          const double t = (level - from) / (to - from);
          ends.emplace_back((1 - t) * mesh.vertices.row(mesh.faces(f, k)) +
                            t * mesh.vertices.row(mesh.faces(f, (k + 1) % 3)));
        }
      }
      if (ends.size() == 2) {
        lengths[static_cast<std::size_t>(bin)] += (ends[0] - ends[1]).norm();
      }
    }
  }
  return lengths;
}

/// The distance at which a limb becomes a trunk; none where it does not.
double end_of_limb(const std::vector<double>& lengths) {
  constexpr std::size_t kOver = 5;  // bins
  constexpr double kGrowth = 1;     // m of loop for a metre of distance
  const auto mean = [&](std::size_t from) {
    double sum = 0;
    for (std::size_t i = from; i < from + kOver; ++i) {
      sum += lengths[i] / kOver;
    }
    return sum;
  };
  for (std::size_t i = kOver; i + 2 * kOver <= lengths.size(); ++i) {
    if (mean(i + kOver) - mean(i) > kGrowth * kOver * kBinWidth) {
      return static_cast<double>(i + kOver) * kBinWidth;
    }
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

LimbRoot limb_root(const Mesh& mesh, const Topology& topology, const EdgePaths& paths) {
  constexpr double kShortest = 0.04;               // m
  constexpr double kBefore = 0.03, kAfter = 0.05;  // m about the end of a limb
  LimbRoot root;
  const double end = end_of_limb(loop_lengths(mesh, paths.distances));
  if (!std::isfinite(end) || end < kShortest) {
    return root;
  }
  constexpr int kRounds = 4;
  const std::vector<double> defects =
      neighbor_means(topology, angle_defects(mesh.vertices, topology), kRounds);
  int count = 0;
  for (Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (paths.distances[at] < end - kBefore || paths.distances[at] > end + kAfter) {
      continue;
    }
    root.middle += mesh.vertices.row(v).transpose();
    ++count;
    if (root.vertex < 0 || defects[at] < defects[static_cast<std::size_t>(root.vertex)]) {
      root.vertex = static_cast<int>(v);
    }
  }
  root.middle /= std::max(count, 1);
  return root;
}

}  // namespace atelier
