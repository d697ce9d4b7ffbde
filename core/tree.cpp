#include "core/tree.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "core/points_view.h"
#ifdef ATELIER_HAS_CUDA
#include "core/tree_cuda.h"
#endif

namespace atelier {
namespace {

constexpr Index kQueriesPerChunk = 256;  // queries per chunk

Vec3d vec(const Eigen::Vector3d& v) {
  return {v[0], v[1], v[2]};
}
Eigen::Vector3d eigen(Vec3d v) {
  return {v.x, v.y, v.z};
}

void check_distance(double max_distance) {
  ATELIER_CHECK(max_distance >= 0, "a distance must be 0 or more");
}

void check_ray(const Ray& ray) {
  ATELIER_CHECK(ray.origin.allFinite(), "a ray's origin must be finite");
  ATELIER_CHECK(ray.direction.allFinite() && !ray.direction.isZero(0),
                "a ray's direction must be finite and not 0");
  ATELIER_CHECK(ray.t_min <= ray.t_max, "a ray's t_min must not exceed its t_max");
}

ClosestPoint closest_of(const TreePoint<double>& found) {
  if (found.face < 0) {
    return {};
  }
  return {found.face, eigen(found.nearest.point), eigen(found.nearest.barycentric),
          found.nearest.squared_distance};
}

RayHit hit_of(const TreeHit<double>& found) {
  return found.face < 0 ? RayHit{} : RayHit{found.face, found.t, eigen(found.barycentric)};
}

TreeHit<double> trace(const TreeView<double>& tree, const Ray& ray, bool any) {
  return hit_in_tree(tree, vec(ray.origin), vec(ray.direction), ray.t_min, ray.t_max, any);
}

/// answer(i) for every i, in parallel.
template <class T, class Answer>
std::vector<T> answers(std::size_t n, const Answer& answer) {
  std::vector<T> results(n);
  parallel_for(static_cast<Index>(n), kQueriesPerChunk, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      results[i] = answer(i);
    }
  });
  return results;
}

/// Hits of many rays on either device.
template <class T, class Convert>
std::vector<T> trace_all(const TriangleTree& tree, const std::vector<Ray>& rays, bool any,
                         Device device, const Convert& convert) {
  std::for_each(rays.begin(), rays.end(), check_ray);
  check_device(device);
#ifdef ATELIER_HAS_CUDA
  if (device == Device::Cuda) {
    std::vector<TreeRay<double>> device_rays;
    device_rays.reserve(rays.size());
    for (const Ray& ray : rays) {
      device_rays.push_back({vec(ray.origin), vec(ray.direction), ray.t_min, ray.t_max});
    }
    const std::vector<TreeHit<double>> found = hits_cuda(tree, device_rays, any);
    return answers<T>(rays.size(), [&](Index i) { return convert(found[i]); });
  }
#endif
  const TreeView<double> view = view_of(tree);
  return answers<T>(rays.size(), [&](Index i) { return convert(trace(view, rays[i], any)); });
}

}  // namespace

TreeView<double> view_of(const TriangleTree& tree) {
  return {tree.nodes.data(), tree.faces.data(), tree.vertices.data(),
          static_cast<int>(tree.nodes.size())};
}

ClosestPoint closest_point(const TriangleTree& tree, const Eigen::Vector3d& query,
                           double max_distance) {
  ATELIER_CHECK(query.allFinite(), "a query must be finite");
  check_distance(max_distance);
  return closest_of(nearest_in_tree(view_of(tree), vec(query), max_distance * max_distance));
}

std::vector<ClosestPoint> closest_points(const TriangleTree& tree, const Points& queries,
                                         double max_distance, Device device) {
  return closest_points(tree, view_of(queries), max_distance, device);
}

std::vector<ClosestPoint> closest_points(const TriangleTree& tree, PointsView queries,
                                         double max_distance, Device device) {
  ATELIER_CHECK(queries.allFinite(), "a query must be finite");
  check_distance(max_distance);
  check_device(device);
  const auto query = [&](Index i) { return Vec3d{queries(i, 0), queries(i, 1), queries(i, 2)}; };
  const std::size_t n = static_cast<std::size_t>(queries.rows());
#ifdef ATELIER_HAS_CUDA
  if (device == Device::Cuda) {
    std::vector<Vec3d> device_queries = answers<Vec3d>(n, query);
    const std::vector<TreePoint<double>> found =
        nearest_cuda(tree, device_queries, max_distance * max_distance);
    return answers<ClosestPoint>(n, [&](Index i) { return closest_of(found[i]); });
  }
#endif
  const TreeView<double> view = view_of(tree);
  return answers<ClosestPoint>(n, [&](Index i) {
    return closest_of(nearest_in_tree(view, query(i), max_distance * max_distance));
  });
}

RayHit first_hit(const TriangleTree& tree, const Ray& ray) {
  check_ray(ray);
  return hit_of(trace(view_of(tree), ray, false));
}

std::vector<RayHit> first_hits(const TriangleTree& tree, const std::vector<Ray>& rays,
                               Device device) {
  return trace_all<RayHit>(tree, rays, false, device, hit_of);
}

bool any_hit(const TriangleTree& tree, const Ray& ray) {
  check_ray(ray);
  return trace(view_of(tree), ray, true).face >= 0;
}

std::vector<char> any_hits(const TriangleTree& tree, const std::vector<Ray>& rays, Device device) {
  return trace_all<char>(tree, rays, true, device, [](const TreeHit<double>& found) {
    return static_cast<char>(found.face >= 0);
  });
}

std::vector<int> faces_within(const TriangleTree& tree, const Eigen::Vector3d& point,
                              double radius) {
  ATELIER_CHECK(point.allFinite(), "a query must be finite");
  check_distance(radius);
  const TreeView<double> view = view_of(tree);
  std::vector<int> found;
  walk_near(view, vec(point), radius * radius, [&](const TreeFace& face) {
    if (nearest_on_triangle(vec(point), corners_of(view, face)).squared_distance <=
        radius * radius) {
      found.push_back(face.face);
    }
    return radius * radius;
  });
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<int> faces_in_box(const TriangleTree& tree, const Eigen::Vector3d& low,
                              const Eigen::Vector3d& high) {
  ATELIER_CHECK(low.allFinite() && high.allFinite() && (low.array() <= high.array()).all(),
                "a box must be finite and low <= high");
  const auto touches = [&](Vec3d box_low, Vec3d box_high) {
    return (eigen(box_low).array() <= high.array()).all() &&
           (low.array() <= eigen(box_high).array()).all();
  };
  std::vector<int> found;
  std::vector<int> open;
  if (!tree.nodes.empty()) {
    open.push_back(0);
  }
  while (!open.empty()) {
    const TreeNode<double>& node = tree.nodes[open.back()];
    open.pop_back();
    if (!touches(node.low, node.high)) {
      continue;
    }
    if (node.count == 0) {
      open.push_back(node.first);
      open.push_back(node.first + 1);
      continue;
    }
    for (int slot = node.first; slot < node.first + node.count; ++slot) {
      const Vec3d a = tree.vertices[tree.faces[slot].vertex[0]];
      const Vec3d b = tree.vertices[tree.faces[slot].vertex[1]];
      const Vec3d c = tree.vertices[tree.faces[slot].vertex[2]];
      if (touches(low_of(a, low_of(b, c)), high_of(a, high_of(b, c)))) {
        found.push_back(tree.faces[slot].face);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace atelier
