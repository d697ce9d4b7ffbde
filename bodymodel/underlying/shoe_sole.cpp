#include "bodymodel/underlying/shoe_sole.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr double kStep = 0.01;  // m along the shoe

/// The shoe between two places along it.
struct Slice {
  double lowest = -1e9;                // m along `down`
  double least = 1e9, largest = -1e9;  // m across, of what is near the lowest
  bool found = false;
};

/// Points along the shoe, across it and down.
Points in_axes(const Points& points, const ShoeAxes& axes) {
  Eigen::Matrix3d frame;
  frame << axes.along, axes.down.cross(axes.along), axes.down;
  return points * frame;
}

std::vector<Slice> slices_of(const Points& own, double first, std::size_t count) {
  std::vector<Slice> slices(count);
  const auto slice_at = [&](Index i) -> Slice& {
    const double place = std::floor((own(i, 0) - first) / kStep);
    return slices[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(count) - 1))];
  };
  for (Index i = 0; i < own.rows(); ++i) {
    slice_at(i).lowest = std::max(slice_at(i).lowest, own(i, 2));
    slice_at(i).found = true;
  }
  constexpr double kRim = 0.02;  // m above the lowest, where the shoe is as wide as its sole
  for (Index i = 0; i < own.rows(); ++i) {
    Slice& slice = slice_at(i);
    if (own(i, 2) > slice.lowest - kRim) {
      slice.least = std::min(slice.least, own(i, 1));
      slice.largest = std::max(slice.largest, own(i, 1));
    }
  }
  return slices;
}

/// The mean of the lowest of a slice and those beside it.
double smoothed_lowest(const std::vector<Slice>& slices, std::size_t at) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = at > 0 ? at - 1 : 0; i < std::min(slices.size(), at + 2); ++i) {
    sum += slices[i].found ? slices[i].lowest : 0;
    count += slices[i].found ? 1 : 0;
  }
  return sum / count;
}

}  // namespace

Mesh shoe_sole(const Points& points, const ShoeAxes& axes) {
  constexpr Index kFewest = 100;
  if (points.rows() < kFewest) {
    return {};
  }
  const Points own = in_axes(points, axes);
  const Eigen::RowVector3d low = own.colwise().minCoeff();
  const Eigen::RowVector3d size = own.colwise().maxCoeff() - low;
  if (size[0] < 0.12 || size[0] > 0.45 || size[1] < 0.04 || size[1] > 0.2) {
    return {};
  }
  const std::vector<Slice> slices =
      slices_of(own, low[0], saturating_cast<std::size_t>(std::ceil(size[0] / kStep)));
  constexpr int kColumns = 9;
  const Eigen::Vector3d across = axes.down.cross(axes.along);
  std::vector<Eigen::Vector3d> vertices;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    if (!slices[i].found) {
      continue;
    }
    const double place = low[0] + (static_cast<double>(i) + 0.5) * kStep;
    for (int k = 0; k < kColumns; ++k) {
      const double share = static_cast<double>(k) / (kColumns - 1);
      vertices.emplace_back(place * axes.along +
                            ((1 - share) * slices[i].least + share * slices[i].largest) * across +
                            smoothed_lowest(slices, i) * axes.down);
    }
  }
  Mesh sole;
  const auto rows = static_cast<int>(vertices.size()) / kColumns;
  sole.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    sole.vertices.row(static_cast<Index>(v)) = vertices[v].transpose();
  }
  sole.faces.resize(static_cast<Index>(2) * std::max(0, rows - 1) * (kColumns - 1), 3);
  Index face = 0;
  for (int row = 0; row + 1 < rows; ++row) {
    for (int k = 0; k + 1 < kColumns; ++k) {
      const int at = row * kColumns + k;
      sole.faces.row(face++) << at, at + kColumns, at + kColumns + 1;
      sole.faces.row(face++) << at, at + kColumns + 1, at + 1;
    }
  }
  return sole;
}

}  // namespace atelier
