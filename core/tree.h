#pragma once

#include <limits>
#include <vector>

#include "core/device.h"
#include "core/tree_math.h"
#include "core/types.h"

namespace atelier {

/// A tree of boxes over triangles, for closest points, rays and overlaps. The boxes follow moving
/// vertices (refit_tree) while the tree keeps its shape. Points are triangles whose three corners
/// are one vertex (build_point_tree). Build it with build_tree; copy it freely.
struct TriangleTree {
  std::vector<TreeNode<double>> nodes;  ///< root first, level by level; empty: no faces
  std::vector<int> level_begin;         ///< first node of each level, and the number of nodes
  std::vector<TreeFace> faces;          ///< slots of the leaves
  std::vector<Vec3d> vertices;          ///< metres
};

/// How build_tree cuts.
struct TreeOptions {
  int leaf_size = 4;  ///< most faces of a leaf, 1..64; larger builds quicker and asks slower
};

/// Tree over the faces: top down, cut by the binned surface area heuristic (Wald, "On fast
/// construction of SAH-based bounding volume hierarchies", 2007; 16 bins), by the median below 32
/// levels. The same on any number of threads. O(F log F).
/// Throws LogicError unless every face names existing vertices and every coordinate is finite and
/// below 1e100 m.
TriangleTree build_tree(const Points& vertices, const Triangles& faces,
                        const TreeOptions& options = {});

/// Tree over points; `face` in every answer is the point's index.
TriangleTree build_point_tree(const Points& points, const TreeOptions& options = {});

/// The same tree over moved vertices: `tree = refit_tree(std::move(tree), vertices)`. Answers stay
/// exact; they come slower the more the motion tears neighbours apart. O(V + F).
/// Throws LogicError if the number of vertices differs or a coordinate is not finite.
TriangleTree refit_tree(TriangleTree tree, const Points& vertices);

/// As kernels and loops see it. Valid while the tree is.
TreeView<double> view_of(const TriangleTree& tree);

/// Nearest point on a surface.
struct ClosestPoint {
  int face = -1;                                    ///< -1: nothing within the distance asked for
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();  ///< of the face's corners; sums to 1
  double squared_distance = std::numeric_limits<double>::infinity();  ///< square metres
};

/// Nearest point of the surface within `max_distance` metres; of faces at the same distance the
/// lowest. Throws LogicError unless the query is finite and max_distance >= 0. About O(log F).
ClosestPoint closest_point(const TriangleTree& tree, const Eigen::Vector3d& query,
                           double max_distance = std::numeric_limits<double>::infinity());

/// The same for every row of `queries`, in parallel.
std::vector<ClosestPoint> closest_points(
    const TriangleTree& tree, const Points& queries,
    double max_distance = std::numeric_limits<double>::infinity(), Device device = Device::Cpu);

/// A half line, or a segment of one.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();        ///< metres
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();    ///< any length but 0; the unit of t
  double t_min = 0;                                        ///< hits count from here
  double t_max = std::numeric_limits<double>::infinity();  ///< to here, both included
};

/// Where a ray meets a surface.
struct RayHit {
  int face = -1;  ///< -1: nothing
  double t = std::numeric_limits<double>::infinity();
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();  ///< of the face's corners; sums to 1
};

/// First hit, from either side; of faces hit at the same t the lowest. No ray passes between two
/// faces that share an edge. Points are never hit. Throws LogicError unless origin and direction
/// are finite, the direction is not 0 and t_min <= t_max.
RayHit first_hit(const TriangleTree& tree, const Ray& ray);

/// The same for many rays, in parallel.
std::vector<RayHit> first_hits(const TriangleTree& tree, const std::vector<Ray>& rays,
                               Device device = Device::Cpu);

/// True if the ray meets the surface at all. Quicker than first_hit.
bool any_hit(const TriangleTree& tree, const Ray& ray);

/// The same for many rays, in parallel: 1 hit, 0 not.
std::vector<char> any_hits(const TriangleTree& tree, const std::vector<Ray>& rays,
                           Device device = Device::Cpu);

/// Faces that come within `radius` metres of a point, increasing. Throws LogicError unless the
/// point is finite and radius >= 0.
std::vector<int> faces_within(const TriangleTree& tree, const Eigen::Vector3d& point,
                              double radius);

/// Faces whose own boxes touch the box [low, high], increasing: every face that meets the box, and
/// some that only come near. Throws LogicError unless both are finite and low <= high.
std::vector<int> faces_in_box(const TriangleTree& tree, const Eigen::Vector3d& low,
                              const Eigen::Vector3d& high);

}  // namespace atelier
