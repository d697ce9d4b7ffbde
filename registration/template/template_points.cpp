#include "registration/template/template_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "core/error.h"
#include "core/normals.h"
#include "core/saturating_cast.h"
#include "core/topology.h"
#include "core/tree.h"

namespace atelier {
namespace {

constexpr double kIsland = 0.02;        // share of the label's area
constexpr double kLoosest = 0.04;       // m, gap at which the body says where cloth is
constexpr double kCoverWeight = 0.1;    // of a point that is made up
constexpr double kInsideReach = 0.5;    // m
constexpr double kThickest = 0.03;      // m between the two sides of a layer of cloth in a scan
constexpr int kMaxSteps = 64;           // along an edge of a face
constexpr double kUnsupportedAt = 5.0;  // spacings

/// Faces all of whose corners have the label and were seen, without small islands.
Triangles label_faces(const Mesh& scan, std::uint8_t label) {
  std::vector<std::array<int, 3>> kept;
  for (Index f = 0; f < scan.faces.rows(); ++f) {
    bool all = true;
    for (int k = 0; k < 3; ++k) {
      all = all && scan.labels[static_cast<std::size_t>(scan.faces(f, k))] == label &&
            (scan.confidence.size() == 0 || scan.confidence[scan.faces(f, k)] > 0);
    }
    if (all) {
      kept.push_back({scan.faces(f, 0), scan.faces(f, 1), scan.faces(f, 2)});
    }
  }
  Triangles faces(static_cast<Index>(kept.size()), 3);
  for (Index f = 0; f < faces.rows(); ++f) {
    const std::array<int, 3>& face = kept[static_cast<std::size_t>(f)];
    faces.row(f) << face[0], face[1], face[2];
  }
  const Components pieces = connected_components(topology_of(faces, scan.vertices.rows()));
  const Eigen::VectorXd areas = face_areas(scan.vertices, faces);
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(pieces.count);
  for (Index f = 0; f < faces.rows(); ++f) {
    sums[pieces.of_face[static_cast<std::size_t>(f)]] += areas[f];
  }
  Index count = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    if (sums[pieces.of_face[static_cast<std::size_t>(f)]] >= kIsland * areas.sum()) {
      faces.row(count++) = Triangles::RowXpr(faces.row(f)).eval();
    }
  }
  faces.conservativeResize(count, 3);
  return faces;
}

/// Points all over the faces, no farther apart than `spacing`, with the normals of their corners.
void sample(GarmentPoints& cloud, const Mesh& scan, const Triangles& faces, const Points& normals,
            double spacing) {
  std::vector<Eigen::RowVector3d> points;
  std::vector<Eigen::RowVector3d> directions;
  for (Index f = 0; f < faces.rows(); ++f) {
    Eigen::Matrix3d at;
    Eigen::Matrix3d up;
    for (int k = 0; k < 3; ++k) {
      at.row(k) = scan.vertices.row(faces(f, k));
      up.row(k) = normals.row(faces(f, k));
    }
    const double longest = std::max({(at.row(0) - at.row(1)).norm(), (at.row(1) - at.row(2)).norm(),
                                     (at.row(2) - at.row(0)).norm()});
    const int steps = std::clamp(saturating_cast<int>(std::ceil(longest / spacing)), 1, kMaxSteps);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const Eigen::RowVector3d weights = Eigen::RowVector3d(i, j, steps - i - j) / steps;
        const Eigen::RowVector3d direction = weights * up;
        const double length = direction.norm();
        if (length > 0.1) {
          points.emplace_back(weights * at);
          directions.emplace_back(direction / length);
        }
      }
    }
  }
  cloud.points.resize(static_cast<Index>(points.size()), 3);
  cloud.normals.resize(cloud.points.rows(), 3);
  for (Index i = 0; i < cloud.points.rows(); ++i) {
    cloud.points.row(i) = points[static_cast<std::size_t>(i)];
    cloud.normals.row(i) = directions[static_cast<std::size_t>(i)];
  }
}

/// Leaves out what looks at the body with the outside close behind it: the inside of loose cloth.
/// And what is far from any body.
void drop_insides(GarmentPoints& cloud, const Mesh& scan, const Triangles& faces,
                  const Points& body, const Triangles& body_faces) {
  const TriangleTree outside = build_tree(scan.vertices, faces);
  const Points face_normal = face_normals(scan.vertices, faces);
  const std::vector<ClosestPoint> nearest =
      closest_points(build_tree(body, body_faces), cloud.points, kInsideReach);
  const Points body_normals = face_normals(body, body_faces);
  Index count = 0;
  for (Index i = 0; i < cloud.points.rows(); ++i) {
    const ClosestPoint& place = nearest[static_cast<std::size_t>(i)];
    if (place.face < 0) {
      continue;
    }
    // Off the skin the way to the body tells inside from outside, on it the skin's normal does.
    const Eigen::Vector3d away = cloud.points.row(i).transpose() - place.point;
    const double distance = away.norm();
    const Eigen::Vector3d outwards =
        distance > 0.01 ? Eigen::Vector3d(away / distance)
                        : Eigen::Vector3d(body_normals.row(place.face).transpose());
    const Eigen::Vector3d normal = cloud.normals.row(i).transpose();
    if (normal.dot(outwards) < -0.3) {
      const RayHit behind =
          first_hit(outside, {cloud.points.row(i).transpose(), -normal, 1e-3, kThickest});
      if (behind.face >= 0 && face_normal.row(behind.face).dot(normal) < 0) {
        continue;
      }
    }
    cloud.points.row(count) = cloud.points.row(i).eval();
    cloud.normals.row(count) = cloud.normals.row(i).eval();
    ++count;
  }
  cloud.points.conservativeResize(count, 3);
  cloud.normals.conservativeResize(count, 3);
}

/// Sums over a cube.
struct Cube {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double count = 0;
};

/// Means over cubes, in the order of the cubes.
void thin(GarmentPoints& cloud, double spacing) {
  std::map<std::array<long, 3>, Cube> cubes;
  for (Index i = 0; i < cloud.points.rows(); ++i) {
    std::array<long, 3> key{};
    for (std::size_t c = 0; c < 3; ++c) {
      key[c] = saturating_cast<long>(std::floor(cloud.points(i, static_cast<Index>(c)) / spacing));
    }
    Cube& cube = cubes[key];
    cube.point += cloud.points.row(i).transpose();
    cube.normal += cloud.normals.row(i).transpose();
    cube.count += 1;
  }
  Index count = 0;
  for (const auto& [key, cube] : cubes) {
    const double length = cube.normal.norm();
    if (length >= 0.5 * cube.count) {
      cloud.points.row(count) = (cube.point / cube.count).transpose();
      cloud.normals.row(count) = (cube.normal / length).transpose();
      ++count;
    }
  }
  cloud.points.conservativeResize(count, 3);
  cloud.normals.conservativeResize(count, 3);
}

void append(GarmentPoints& cloud, const std::vector<Eigen::Vector3d>& points,
            const std::vector<Eigen::Vector3d>& normals) {
  const Index first = cloud.points.rows();
  const Index count = first + static_cast<Index>(points.size());
  cloud.points.conservativeResize(count, 3);
  cloud.normals.conservativeResize(count, 3);
  cloud.weights.conservativeResize(count);
  for (Index i = first; i < count; ++i) {
    cloud.points.row(i) = points[static_cast<std::size_t>(i - first)].transpose();
    cloud.normals.row(i) = normals[static_cast<std::size_t>(i - first)].transpose();
    cloud.weights[i] = kCoverWeight;
  }
}

}  // namespace

GarmentPoints garment_points(const Mesh& scan, std::uint8_t label, const Points& body,
                             const Triangles& body_faces, double spacing) {
  ATELIER_CHECK(spacing > 0, "a spacing above 0");
  ATELIER_CHECK(static_cast<Index>(scan.labels.size()) == scan.vertices.rows(), "a labelled scan");
  GarmentPoints cloud;
  const Triangles faces = label_faces(scan, label);
  sample(cloud, scan, faces, vertex_normals(scan.vertices, scan.faces), spacing);
  drop_insides(cloud, scan, faces, body, body_faces);
  thin(cloud, spacing);
  cloud.seen = cloud.points.rows();
  cloud.observed = cloud.seen;
  cloud.weights = Eigen::VectorXd::Ones(cloud.seen);
  return cloud;
}

void add_covered(GarmentPoints& cloud, const Points& body, const Triangles& body_faces,
                 const GarmentCover& cover, double spacing) {
  if (cloud.observed == 0) {
    return;
  }
  const TriangleTree own = build_point_tree(cloud.points);
  const Points smooth = vertex_normals(body, body_faces);
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> outwards;
  for (Index v = 0; v < body.rows(); ++v) {
    if (cover.share[v] <= 0.5 || cover.gap[v] > kLoosest || smooth.row(v).squaredNorm() < 0.5) {
      continue;
    }
    const Eigen::Vector3d point =
        body.row(v).transpose() + std::max(cover.gap[v], 0.0) * smooth.row(v).transpose();
    if (closest_point(own, point, kUnsupportedAt * spacing).face < 0) {
      points.push_back(point);
      outwards.emplace_back(smooth.row(v).transpose());
    }
  }
  append(cloud, points, outwards);
}

}  // namespace atelier
