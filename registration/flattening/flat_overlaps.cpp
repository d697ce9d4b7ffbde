#include "registration/flattening/flat_overlaps.h"

#include <algorithm>
#include <cstdint>
#include <unordered_map>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "core/error.h"
#include "core/saturating_cast.h"
#include "core/topology.h"

namespace atelier {
namespace {

using OverlapKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corners2 = std::array<OverlapKernel::Point_2, 3>;

std::vector<Corners2> corners_in_plane(const Points2& flat, const Triangles& faces) {
  ATELIER_CHECK(flat.allFinite(), "finite places");
  std::vector<Corners2> corners(static_cast<std::size_t>(faces.rows()));
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = faces(f, k);
      ATELIER_CHECK(v >= 0 && v < flat.rows(), "triangles of these vertices");
      corners[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] = {flat(v, 0), flat(v, 1)};
    }
  }
  return corners;
}

bool is_counter_clockwise(const Corners2& corners) {
  return CGAL::orientation(corners[0], corners[1], corners[2]) == CGAL::LEFT_TURN;
}

/// True if all of `other` is on the outer side of an edge.
bool parted_by_an_edge(const Corners2& corners, const Corners2& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    const bool outside = std::all_of(other.begin(), other.end(), [&](const auto& point) {
      return CGAL::orientation(corners[k], corners[(k + 1) % 3], point) != CGAL::LEFT_TURN;
    });
    if (outside) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<std::array<int, 2>> overlapping_faces(const Points2& flat, const Triangles& faces) {
  const std::vector<Corners2> corners = corners_in_plane(flat, faces);
  struct Box {
    double left, right, low, high;
  };
  std::vector<Box> boxes;
  std::vector<int> order;
  for (Index f = 0; f < faces.rows(); ++f) {
    const Corners2& c = corners[static_cast<std::size_t>(f)];
    const auto [left, right] = std::minmax({c[0].x(), c[1].x(), c[2].x()});
    const auto [low, high] = std::minmax({c[0].y(), c[1].y(), c[2].y()});
    boxes.push_back({left, right, low, high});
    if (is_counter_clockwise(c)) {
      order.push_back(static_cast<int>(f));
    }
  }
  const auto box = [&](int face) -> const Box& { return boxes[static_cast<std::size_t>(face)]; };
  std::sort(order.begin(), order.end(), [&](int f, int g) { return box(f).left < box(g).left; });
  // From left to right; `open` are those that may reach as far.
  std::vector<std::array<int, 2>> pairs;
  std::vector<int> open;
  for (const int f : order) {
    std::erase_if(open, [&](int g) { return box(g).right <= box(f).left; });
    for (const int g : open) {
      if (box(g).low >= box(f).high || box(f).low >= box(g).high) {
        continue;
      }
      const Corners2& a = corners[static_cast<std::size_t>(f)];
      const Corners2& b = corners[static_cast<std::size_t>(g)];
      if (!parted_by_an_edge(a, b) && !parted_by_an_edge(b, a)) {
        pairs.push_back({std::min(f, g), std::max(f, g)});
      }
    }
    open.push_back(f);
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

bool crosses_itself(const Points2& loop) {
  const Index count = loop.rows();
  if (count < 3) {
    return true;
  }
  double mean = 0;
  for (Index i = 0; i < count; ++i) {
    mean += (loop.row((i + 1) % count) - loop.row(i)).norm();
  }
  mean = std::max(mean / static_cast<double>(count), 1e-12);
  // Segments by the cells of a grid that they may pass through.
  std::unordered_map<std::int64_t, std::vector<Index>> cells;
  const Eigen::RowVector2d low = loop.colwise().minCoeff();
  const auto cell = [&](double value, double from) {
    return saturating_cast<std::int64_t>((value - from) / (2 * mean));
  };
  const auto corner = [&](Index i) {
    return OverlapKernel::Point_2(loop(i % count, 0), loop(i % count, 1));
  };
  const auto segment = [&](Index i) { return OverlapKernel::Segment_2(corner(i), corner(i + 1)); };
  for (Index i = 0; i < count; ++i) {
    // Beside each other, segments meet in more than their common corner where one goes back.
    if (corner(i) == corner(i + 1) ||
        (CGAL::collinear(corner(i), corner(i + 1), corner(i + 2)) &&
         CGAL::angle(corner(i), corner(i + 1), corner(i + 2)) == CGAL::ACUTE)) {
      return true;
    }
  }
  for (Index i = 0; i < count; ++i) {
    const Eigen::RowVector2d a = loop.row(i);
    const Eigen::RowVector2d b = loop.row((i + 1) % count);
    const Eigen::RowVector2d from = a.cwiseMin(b);
    const Eigen::RowVector2d to = a.cwiseMax(b);
    for (std::int64_t x = cell(from.x(), low.x()); x <= cell(to.x(), low.x()); ++x) {
      for (std::int64_t y = cell(from.y(), low.y()); y <= cell(to.y(), low.y()); ++y) {
        std::vector<Index>& here = cells[(x << 32) ^ y];
        for (const Index j : here) {
          const Index apart = i - j;
          if (apart > 1 && apart < count - 1 && CGAL::do_intersect(segment(i), segment(j))) {
            return true;
          }
        }
        here.push_back(i);
      }
    }
  }
  return false;
}

bool lies_over_itself(const Points2& flat, const Triangles& faces) {
  for (const std::vector<int>& loop : boundary_loops(topology_of(faces, flat.rows()))) {
    if (crosses_itself(flat(loop, Eigen::all))) {
      return true;
    }
  }
  return !overlapping_faces(flat, faces).empty();
}

int turned_faces(const Points2& flat, const Triangles& faces) {
  const std::vector<Corners2> corners = corners_in_plane(flat, faces);
  return static_cast<int>(std::count_if(corners.begin(), corners.end(), [](const Corners2& one) {
    return !is_counter_clockwise(one);
  }));
}

}  // namespace atelier
