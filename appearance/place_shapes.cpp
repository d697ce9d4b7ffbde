#include "appearance/place_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/error.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

constexpr int kCells = 128;  // a side
constexpr int kWords = kCells / 64;
constexpr int kAngles = 16;
constexpr int kFew = 8;  // shapes, for which the first one's angle is tried in turn

/// Cells of the square, a bit each, row by row.
using CellRow = std::array<std::uint64_t, kWords>;
using CellGrid = std::array<CellRow, kCells>;

/// Cells that a shape touches, from its own lower left corner.
struct ShapeMask {
  Eigen::Vector2d low{0, 0};  ///< of the turned shape, in cells
  int width = 0;
  int height = 0;
  std::vector<CellRow> rows;
};

void set_cells(CellRow& row, int begin, int end) {
  for (int x = begin; x < end; ++x) {
    row[static_cast<std::size_t>(x) / 64] |= std::uint64_t{1} << (x % 64);
  }
}

/// The row moved right by `x` cells; what leaves it must be empty.
CellRow moved(const CellRow& row, int x) {
  CellRow out{};
  const int words = x / 64;
  const int bits = x % 64;
  for (int w = kWords - 1; w >= words; --w) {
    const auto from = static_cast<std::size_t>(w - words);
    out[static_cast<std::size_t>(w)] = row[from] << bits;
    if (bits > 0 && from > 0) {
      out[static_cast<std::size_t>(w)] |= row[from - 1] >> (64 - bits);
    }
  }
  return out;
}

/// The shape turned by `angle` at `scale` cells a unit, or none where it is larger than the square.
std::optional<ShapeMask> mask_of(const FlatShape& shape, double angle, double scale) {
  const Eigen::Rotation2Dd turn(angle);
  Points2 points(shape.points.rows(), 2);
  for (Index i = 0; i < points.rows(); ++i) {
    points.row(i) = (scale * (turn * shape.points.row(i).transpose())).transpose();
  }
  ShapeMask mask;
  mask.low = points.colwise().minCoeff().transpose();
  points.rowwise() -= mask.low.transpose();
  const Eigen::Vector2d size = points.colwise().maxCoeff().transpose();
  if (!(size.maxCoeff() < kCells - 1)) {
    return std::nullopt;
  }
  mask.width = saturating_cast<int>(size.x() + 1);
  mask.height = saturating_cast<int>(size.y() + 1);
  mask.rows.assign(static_cast<std::size_t>(mask.height), CellRow{});
  for (Index f = 0; f < shape.faces.rows(); ++f) {
    std::array<Eigen::Vector2d, 3> corner;
    for (int k = 0; k < 3; ++k) {
      corner[static_cast<std::size_t>(k)] = points.row(shape.faces(f, k)).transpose();
    }
    const auto [bottom, top] = std::minmax({corner[0].y(), corner[1].y(), corner[2].y()});
    for (int y = static_cast<int>(bottom); y <= static_cast<int>(top); ++y) {
      // The part of the triangle between the lines y and y + 1.
      double left = std::numeric_limits<double>::infinity();
      double right = -left;
      const auto reach = [&](double x) {
        left = std::min(left, x);
        right = std::max(right, x);
      };
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector2d& a = corner[k];
        const Eigen::Vector2d& b = corner[(k + 1) % 3];
        if (a.y() >= y && a.y() <= y + 1) {
          reach(a.x());
        }
        for (const double line : {static_cast<double>(y), y + 1.0}) {
          if ((a.y() < line) != (b.y() < line)) {
            reach(a.x() + (line - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
          }
        }
      }
      if (left <= right) {
        set_cells(mask.rows[static_cast<std::size_t>(y)], std::max(0, saturating_cast<int>(left)),
                  std::min(mask.width, saturating_cast<int>(right + 1)));
      }
    }
  }
  return mask;
}

bool is_free(const CellGrid& taken, const ShapeMask& mask, int x, int y) {
  for (int row = 0; row < mask.height; ++row) {
    const CellRow here = moved(mask.rows[static_cast<std::size_t>(row)], x);
    const CellRow& there = taken[static_cast<std::size_t>(y) + static_cast<std::size_t>(row)];
    for (std::size_t w = 0; w < kWords; ++w) {
      if ((here[w] & there[w]) != 0) {
        return false;
      }
    }
  }
  return true;
}

/// The lowest place, of those the leftmost, whose top is below `ceiling`.
std::optional<std::array<int, 2>> lowest_place(const CellGrid& taken, const ShapeMask& mask,
                                               int margin, int ceiling) {
  const int last = std::min(kCells - margin, ceiling - 1) - mask.height;
  for (int y = margin; y <= last; ++y) {
    for (int x = margin; x + mask.width + margin <= kCells; ++x) {
      if (is_free(taken, mask, x, y)) {
        return std::array<int, 2>{x, y};
      }
    }
  }
  return std::nullopt;
}

/// Takes the cells of a mask and those within `margin` of them.
void take(CellGrid& taken, const ShapeMask& mask, int x, int y, int margin) {
  for (int row = 0; row < mask.height; ++row) {
    const CellRow& own = mask.rows[static_cast<std::size_t>(row)];
    CellRow wide{};
    for (int c = 0; c < mask.width; ++c) {
      if ((own[static_cast<std::size_t>(c) / 64] >> (c % 64) & 1U) != 0) {
        set_cells(wide, std::max(0, x + c - margin), std::min(kCells, x + c + margin + 1));
      }
    }
    for (int to = std::max(0, y + row - margin); to <= std::min(kCells - 1, y + row + margin);
         ++to) {
      for (std::size_t w = 0; w < kWords; ++w) {
        taken[static_cast<std::size_t>(to)][w] |= wide[w];
      }
    }
  }
}

/// ShapeMasks of a shape at every angle; where one is missing, the shape is larger than the square.
using ShapeMasks = std::array<std::optional<ShapeMask>, kAngles>;

/// One try: the first shape at one angle, or at the best for -1; empty where there is no room.
std::vector<PlacedShape> laid(const std::vector<ShapeMasks>& masks,
                              const std::vector<std::size_t>& order, int margin, int first_angle) {
  CellGrid taken{};
  std::vector<PlacedShape> placed(masks.size());
  for (const std::size_t i : order) {
    int ceiling = kCells + 1;
    int angle = -1;
    std::array<int, 2> at{};
    for (int a = 0; a < kAngles; ++a) {
      const std::optional<ShapeMask>& mask = masks[i][static_cast<std::size_t>(a)];
      if (!mask || (i == order.front() && first_angle >= 0 && a != first_angle)) {
        continue;
      }
      if (const auto place = lowest_place(taken, *mask, margin, ceiling)) {
        ceiling = (*place)[1] + mask->height;
        angle = a;
        at = *place;
      }
    }
    if (angle < 0) {
      return {};
    }
    const ShapeMask& mask = *masks[i][static_cast<std::size_t>(angle)];
    take(taken, mask, at[0], at[1], margin);
    placed[i] = {2 * std::numbers::pi * angle / kAngles,
                 (Eigen::Vector2d(at[0], at[1]) - mask.low) / kCells};
  }
  return placed;
}

std::vector<PlacedShape> laid_at(const std::vector<FlatShape>& shapes,
                                 const std::vector<std::size_t>& order, double scale, int margin) {
  std::vector<ShapeMasks> masks(shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    for (int a = 0; a < kAngles; ++a) {
      masks[i][static_cast<std::size_t>(a)] =
          mask_of(shapes[i], 2 * std::numbers::pi * a / kAngles, kCells * scale);
    }
  }
  const int last = shapes.size() <= kFew ? kAngles : 0;
  for (int first = -1; first < last; ++first) {
    std::vector<PlacedShape> placed = laid(masks, order, margin, first);
    if (!placed.empty()) {
      return placed;
    }
  }
  return {};
}

double area_of(const FlatShape& shape) {
  double sum = 0;
  for (Index f = 0; f < shape.faces.rows(); ++f) {
    const Eigen::RowVector2d a = shape.points.row(shape.faces(f, 0));
    const Eigen::RowVector2d b = shape.points.row(shape.faces(f, 1)) - a;
    const Eigen::RowVector2d c = shape.points.row(shape.faces(f, 2)) - a;
    sum += std::abs(b.x() * c.y() - b.y() * c.x()) / 2;
  }
  return sum;
}

}  // namespace

ShapePlacement place_shapes(const std::vector<FlatShape>& shapes, double margin, double least) {
  ATELIER_CHECK(margin > 0 && margin < 0.5 && least > 0, "a margin and a scale above 0");
  ShapePlacement best;
  std::vector<double> areas;
  for (const FlatShape& shape : shapes) {
    ATELIER_CHECK(shape.faces.rows() > 0 && shape.points.allFinite(),
                  "shapes that cover something");
    areas.push_back(area_of(shape));
  }
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  if (!(total > 0)) {
    return best;
  }
  std::vector<std::size_t> order(shapes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return areas[a] > areas[b]; });
  const int cells = saturating_cast<int>(std::ceil(margin * kCells));
  double low = least;
  double high = std::max(least, 1 / std::sqrt(total));
  constexpr double kNear = 1.005;  // of the largest scale
  for (double scale = low; scale <= high; scale = std::sqrt(low * high)) {
    std::vector<PlacedShape> placed = laid_at(shapes, order, scale, cells);
    if (placed.empty()) {
      high = scale;
      if (best.scale == 0) {
        break;  // not even the least
      }
    } else {
      best = {scale, std::move(placed)};
      low = scale;
    }
    if (high < kNear * low) {
      break;
    }
  }
  return best;
}

}  // namespace atelier
