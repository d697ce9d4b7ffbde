#include <algorithm>
#include <array>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "core/points_view.h"
#include "core/saturating_cast.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr int kBins = 16;
constexpr int kMedianFrom = 32;  // levels; the median needs at most 31 more for 2^31 faces
constexpr double kLargestTreeCoordinate = 1e100;

/// A box that grows.
struct Box {
  std::array<double, 3> low = {1e300, 1e300, 1e300};
  std::array<double, 3> high = {-1e300, -1e300, -1e300};

  void add(const std::array<double, 3>& p) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  void add(const Box& box) {
    add(box.low);
    add(box.high);
  }
  /// Half the surface. Empty boxes have none.
  double area() const {
    const double x = high[0] - low[0];
    const double y = high[1] - low[1];
    const double z = high[2] - low[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
  }
};

/// Bounds and centre of one face, for the cuts.
struct Part {
  Box box;
  std::array<double, 3> center;
  int face;
};

/// A node to be made: parts [begin, end).
struct Task {
  int begin;
  int end;
};

using Parts = std::vector<Part>;

int bin_of(const Part& part, int axis, const Box& centers) {
  const double extent = centers.high[axis] - centers.low[axis];
  const double place = (part.center[axis] - centers.low[axis]) / extent * kBins;
  return std::clamp(saturating_cast<int>(place), 0, kBins - 1);
}

/// The cheapest cut: parts in bins below `bin` of `axis` go left; axis -1: no cut parts them.
struct Cut {
  int axis = -1;
  int bin = 0;
  double cost = 1e300;
};

Cut cheapest_cut(const Parts& parts, const Task& task, const Box& centers) {
  Cut best;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(centers.high[axis] > centers.low[axis])) {
      continue;
    }
    std::array<Box, kBins> boxes;
    std::array<int, kBins> counts{};
    for (int i = task.begin; i < task.end; ++i) {
      const int bin = bin_of(parts[i], axis, centers);
      boxes[bin].add(parts[i].box);
      ++counts[bin];
    }
    std::array<double, kBins> right_cost{};  // of bins [i, kBins)
    Box right;
    int right_count = 0;
    for (int i = kBins - 1; i > 0; --i) {
      right.add(boxes[i]);
      right_count += counts[i];
      right_cost[i] = right.area() * right_count;
    }
    Box left;
    int left_count = 0;
    for (int i = 1; i < kBins; ++i) {
      left.add(boxes[i - 1]);
      left_count += counts[i - 1];
      const double cost = left.area() * left_count + right_cost[i];
      if (left_count > 0 && left_count < task.end - task.begin && cost < best.cost) {
        best = {axis, i, cost};
      }
    }
  }
  return best;
}

/// Reorders the parts of a task and returns where its right half begins.
int split(Parts& parts, const Task& task, int level) {
  const auto begin = parts.begin() + task.begin;
  const auto end = parts.begin() + task.end;
  Box centers;
  for (auto part = begin; part != end; ++part) {
    centers.add(part->center);
  }
  if (level < kMedianFrom) {
    const Cut cut = cheapest_cut(parts, task, centers);
    if (cut.axis >= 0) {
      const auto middle = std::stable_partition(
          begin, end, [&](const Part& part) { return bin_of(part, cut.axis, centers) < cut.bin; });
      return static_cast<int>(middle - parts.begin());
    }
  }
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    if (centers.high[k] - centers.low[k] > centers.high[axis] - centers.low[axis]) {
      axis = k;
    }
  }
  const auto middle = begin + (end - begin) / 2;
  std::nth_element(begin, middle, end, [axis](const Part& a, const Part& b) {
    return a.center[axis] != b.center[axis] ? a.center[axis] < b.center[axis] : a.face < b.face;
  });
  return static_cast<int>(middle - parts.begin());
}

std::vector<Vec3d> checked_vertices(PointsView vertices) {
  // A comparison with NaN is false.
  ATELIER_CHECK(vertices.rows() == 0 || (vertices.array().abs() < kLargestTreeCoordinate).all(),
                "a tree needs finite coordinates below 1e100 m");
  std::vector<Vec3d> copy(static_cast<std::size_t>(vertices.rows()));
  for (Index i = 0; i < vertices.rows(); ++i) {
    copy[i] = {vertices(i, 0), vertices(i, 1), vertices(i, 2)};
  }
  return copy;
}

void refit_nodes(TriangleTree& tree) {
  const Index levels = static_cast<Index>(tree.level_begin.size()) - 1;
  for (Index level = levels - 1; level >= 0; --level) {
    const int first = tree.level_begin[level];
    parallel_for(tree.level_begin[level + 1] - first, 4096, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        refit_node(tree.nodes.data(), static_cast<int>(first + i), tree.faces.data(),
                   tree.vertices.data());
      }
    });
  }
}

}  // namespace

TriangleTree build_tree(const Points& vertices, const Triangles& faces,
                        const TreeOptions& options) {
  ATELIER_CHECK(options.leaf_size >= 1 && options.leaf_size <= 64, "leaf_size must be 1..64");
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices.rows()),
                "a face names a vertex that is not there");
  TriangleTree tree;
  tree.vertices = checked_vertices(view_of(vertices));
  if (faces.rows() == 0) {
    return tree;
  }

  Parts parts(static_cast<std::size_t>(faces.rows()));
  parallel_for(faces.rows(), 4096, [&](Index begin, Index end) {
    for (Index f = begin; f < end; ++f) {
      Part& part = parts[f];
      part.face = static_cast<int>(f);
      for (int k = 0; k < 3; ++k) {
        const auto row = vertices.row(faces(f, k));
        part.box.add(std::array{row[0], row[1], row[2]});
      }
      for (int k = 0; k < 3; ++k) {
        part.center[k] = 0.5 * (part.box.low[k] + part.box.high[k]);
      }
    }
  });

  // Level by level, so that children lie behind their parents and each level can be refitted in
  // parallel.
  std::vector<Task> tasks = {{0, static_cast<int>(parts.size())}};
  tree.level_begin = {0};
  for (int level = 0; !tasks.empty(); ++level) {
    std::vector<int> middles(tasks.size(), -1);  // -1: a leaf
    parallel_for(static_cast<Index>(tasks.size()), 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        if (tasks[i].end - tasks[i].begin > options.leaf_size) {
          middles[i] = split(parts, tasks[i], level);
        }
      }
    });
    std::vector<Task> children;
    const int first_child = tree.level_begin.back() + static_cast<int>(tasks.size());
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      TreeNode<double> node{};
      if (middles[i] < 0) {
        node.first = tasks[i].begin;
        node.count = tasks[i].end - tasks[i].begin;
      } else {
        node.first = first_child + static_cast<int>(children.size());
        children.push_back({tasks[i].begin, middles[i]});
        children.push_back({middles[i], tasks[i].end});
      }
      tree.nodes.push_back(node);
    }
    tree.level_begin.push_back(first_child);
    tasks = std::move(children);
  }

  tree.faces.resize(parts.size());
  for (std::size_t slot = 0; slot < parts.size(); ++slot) {
    const int f = parts[slot].face;
    tree.faces[slot] = {{faces(f, 0), faces(f, 1), faces(f, 2)}, f};
  }
  refit_nodes(tree);
  return tree;
}

TriangleTree build_point_tree(const Points& points, const TreeOptions& options) {
  Triangles faces(points.rows(), 3);
  for (Index i = 0; i < points.rows(); ++i) {
    faces.row(i).setConstant(static_cast<int>(i));
  }
  return build_tree(points, faces, options);
}

TriangleTree refit_tree(TriangleTree tree, const Points& vertices) {
  return refit_tree(std::move(tree), view_of(vertices));
}

TriangleTree refit_tree(TriangleTree tree, PointsView vertices) {
  ATELIER_CHECK(vertices.rows() == static_cast<Index>(tree.vertices.size()),
                "a tree is refitted to as many vertices as it was built from");
  tree.vertices = checked_vertices(vertices);
  if (!tree.nodes.empty()) {
    refit_nodes(tree);
  }
  return tree;
}

}  // namespace atelier
