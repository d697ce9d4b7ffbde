#include "core/winding_number.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#ifdef ATELIER_HAS_CUDA
#include "core/winding_cuda.h"
#endif

namespace atelier {
namespace {

constexpr Index kPointsPerChunk = 256;  // queries per chunk

template <class Row>
Vec3d vec(const Row& row) {
  return {row[0], row[1], row[2]};
}

/// Leaves with more faces than for other queries: far leaves cost one evaluation, near ones are
/// few.
constexpr TreeOptions kTreeOptions = {8};

double largest_corner_distance(const TreeNode<double>& box, Vec3d p) {
  return norm(Vec3d{std::max(p.x - box.low.x, box.high.x - p.x),
                    std::max(p.y - box.low.y, box.high.y - p.y),
                    std::max(p.z - box.low.z, box.high.z - p.z)});
}

WindingMoments<double> slot_moments(const WindingTree& tree, const TreeFace& face) {
  const std::vector<Vec3d>& v = tree.tree.vertices;
  if (tree.area_normals.empty()) {
    return triangle_moments(v[face.vertex[0]], v[face.vertex[1]], v[face.vertex[2]]);
  }
  WindingMoments<double> moments{};
  moments.center = v[face.face];
  moments.normal = tree.area_normals[face.face];
  moments.area = norm(moments.normal);
  return moments;
}

/// Moments of a node from parts of it; `part(k)` for k in [0, count).
template <class Part>
WindingMoments<double> joined(int count, const TreeNode<double>& box, const Part& part) {
  WindingMoments<double> sum{};
  double area = 0;
  for (int k = 0; k < count; ++k) {
    const WindingMoments<double> moments = part(k);
    sum.center += moments.area * moments.center;
    area += moments.area;
  }
  // A cluster without area weighs nothing; any centre will do.
  sum.center = area > 0 ? (1 / area) * sum.center : 0.5 * (box.low + box.high);
  for (int k = 0; k < count; ++k) {
    add_moments(sum, part(k));
  }
  return sum;
}

void compute_moments(WindingTree& winding) {
  const TriangleTree& tree = winding.tree;
  winding.moments.resize(tree.nodes.size());
  for (Index level = static_cast<Index>(tree.level_begin.size()) - 2; level >= 0; --level) {
    const int first = tree.level_begin[level];
    parallel_for(tree.level_begin[level + 1] - first, 512, [&](Index begin, Index end) {
      for (Index i = first + begin; i < first + end; ++i) {
        const TreeNode<double>& node = tree.nodes[i];
        WindingMoments<double>& moments = winding.moments[i];
        if (node.count > 0) {
          moments = joined(node.count, node, [&](int k) {
            return slot_moments(winding, tree.faces[node.first + k]);
          });
          moments.radius = largest_corner_distance(node, moments.center);
        } else {
          moments = joined(2, node, [&](int k) { return winding.moments[node.first + k]; });
          double radius = 0;
          for (int child = node.first; child < node.first + 2; ++child) {
            const WindingMoments<double>& part = winding.moments[child];
            radius = std::max(radius, norm(part.center - moments.center) + part.radius);
          }
          moments.radius = std::min(radius, largest_corner_distance(node, moments.center));
        }
      }
    });
  }
}

WindingView<double> winding_view(const WindingTree& tree) {
  return {view_of(tree.tree), tree.moments.data(),
          tree.area_normals.empty() ? nullptr : tree.area_normals.data()};
}

void check_options(const WindingOptions& options) {
  ATELIER_CHECK(options.accuracy >= 1 && options.accuracy <= 100, "accuracy must be 1..100");
}

void check_points(const Points& points, const Points& normals, const Eigen::VectorXd& areas) {
  ATELIER_CHECK(points.rows() == normals.rows() && points.rows() == areas.size(),
                "points, normals and areas must be as many");
  ATELIER_CHECK(normals.allFinite() && areas.allFinite(), "normals and areas must be finite");
}

}  // namespace

WindingTree build_winding_tree(const Points& vertices, const Triangles& faces) {
  WindingTree tree;
  tree.tree = build_tree(vertices, faces, kTreeOptions);
  compute_moments(tree);
  return tree;
}

WindingTree build_winding_tree(const Points& points, const Points& normals,
                               const Eigen::VectorXd& areas) {
  check_points(points, normals, areas);
  WindingTree tree;
  tree.tree = build_point_tree(points, kTreeOptions);
  for (Index i = 0; i < points.rows(); ++i) {
    tree.area_normals.push_back(areas[i] * vec(normals.row(i)));
  }
  compute_moments(tree);
  return tree;
}

double winding_number(const WindingTree& tree, const Eigen::Vector3d& query,
                      const WindingOptions& options) {
  ATELIER_CHECK(query.allFinite(), "a query must be finite");
  check_options(options);
  return winding_in_tree(winding_view(tree), vec(query), options.accuracy);
}

std::vector<double> winding_numbers(const WindingTree& tree, const Points& queries,
                                    const WindingOptions& options, Device device) {
  ATELIER_CHECK(queries.allFinite(), "a query must be finite");
  check_options(options);
  check_device(device);
  std::vector<Vec3d> all(static_cast<std::size_t>(queries.rows()));
  for (Index i = 0; i < queries.rows(); ++i) {
    all[i] = vec(queries.row(i));
  }
#ifdef ATELIER_HAS_CUDA
  if (device == Device::Cuda) {
    return winding_cuda(tree, all, options.accuracy);
  }
#endif
  const WindingView<double> view = winding_view(tree);
  std::vector<double> numbers(all.size());
  parallel_for(queries.rows(), kPointsPerChunk, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      numbers[i] = winding_in_tree(view, all[i], options.accuracy);
    }
  });
  return numbers;
}

double exact_winding_number(const Points& vertices, const Triangles& faces,
                            const Eigen::Vector3d& query) {
  ATELIER_CHECK(query.allFinite(), "a query must be finite");
  ATELIER_CHECK(faces.rows() == 0 || (faces.minCoeff() >= 0 && faces.maxCoeff() < vertices.rows()),
                "a face names a vertex that is not there");
  const Vec3d q = vec(query);
  double sum = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    sum += solid_angle(q, vec(vertices.row(faces(f, 0))), vec(vertices.row(faces(f, 1))),
                       vec(vertices.row(faces(f, 2))));
  }
  return kInverseFourPi * sum;
}

double exact_winding_number(const Points& points, const Points& normals,
                            const Eigen::VectorXd& areas, const Eigen::Vector3d& query) {
  ATELIER_CHECK(query.allFinite(), "a query must be finite");
  check_points(points, normals, areas);
  double sum = 0;
  for (Index i = 0; i < points.rows(); ++i) {
    sum += dipole_angle(vec(query), vec(points.row(i)), areas[i] * vec(normals.row(i)));
  }
  return kInverseFourPi * sum;
}

}  // namespace atelier
