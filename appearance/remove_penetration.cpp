#include "appearance/remove_penetration.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "core/normals.h"
#include "core/parallel.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kUnder = 0.003;  // m below the cloth
constexpr double kStart = 1e-4;   // m below the skin, where rays begin

/// How far places of the skin are moved against their normals; 0: they stay.
std::vector<double> depths_of_cloth(const Points& places, const Points& normals,
                                    const TriangleTree& skin, const TriangleTree& cloth,
                                    const Points& cloth_normals, double reach) {
  std::vector<double> depths(static_cast<std::size_t>(places.rows()), 0.0);
  parallel_for(places.rows(), 256, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const Eigen::Vector3d normal = normals.row(i).transpose();
      if (!(normal.squaredNorm() > 0.5)) {
        continue;
      }
      Ray ray;
      ray.origin = places.row(i).transpose() - kStart * normal;
      ray.direction = -normal;
      ray.t_max = reach;
      const RayHit hit = first_hit(cloth, ray);
      constexpr double kAlike = 0.2;  // cosine
      if (hit.face < 0 || !(cloth_normals.row(hit.face).dot(normals.row(i)) > kAlike)) {
        continue;
      }
      const double depth = kStart + hit.t + kUnder;
      ray.t_max = depth;
      if (!any_hit(skin, ray)) {
        depths[static_cast<std::size_t>(i)] = depth;
      }
    }
  });
  return depths;
}

}  // namespace

Points remove_penetration(const Points& skin, const Triangles& skin_faces, const Points& cloth,
                          const Triangles& cloth_faces, double reach) {
  if (skin_faces.rows() == 0 || cloth_faces.rows() == 0) {
    return skin;
  }
  const TriangleTree skin_tree = build_tree(skin, skin_faces);
  const TriangleTree cloth_tree = build_tree(cloth, cloth_faces);
  const Points cloth_normals = face_normals(cloth, cloth_faces);
  const Points normals = vertex_normals(skin, skin_faces);
  std::vector<double> depths =
      depths_of_cloth(skin, normals, skin_tree, cloth_tree, cloth_normals, reach);
  // Cloth may dip into the middle of a face, too.
  Points centers(skin_faces.rows(), 3);
  for (Index f = 0; f < skin_faces.rows(); ++f) {
    centers.row(f) =
        (skin.row(skin_faces(f, 0)) + skin.row(skin_faces(f, 1)) + skin.row(skin_faces(f, 2))) / 3;
  }
  const std::vector<double> of_centers = depths_of_cloth(
      centers, face_normals(skin, skin_faces), skin_tree, cloth_tree, cloth_normals, reach);
  for (Index f = 0; f < skin_faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      double& depth = depths[static_cast<std::size_t>(skin_faces(f, k))];
      depth = std::max(depth, of_centers[static_cast<std::size_t>(f)]);
    }
  }
  Points lowered = skin;
  for (Index v = 0; v < skin.rows(); ++v) {
    const double depth = depths[static_cast<std::size_t>(v)];
    if (depth > 0) {
      lowered.row(v) -= depth * normals.row(v);
    }
  }
  return lowered;
}

}  // namespace atelier
