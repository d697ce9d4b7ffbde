#include "simulation/material/bending_rigidity.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "core/error.h"

namespace atelier {
namespace {

/// Corners of a face in a plane whose x is the direction from which angles count.
using FlatCorners = std::array<Eigen::Vector2d, 3>;

FlatCorners flat_corners(const Garment& garment, Index face) {
  FlatCorners out;
  if (garment.rest_faces.rows() > 0) {
    for (int c = 0; c < 3; ++c) {
      out[c] = garment.rest.row(garment.rest_faces(face, c)).transpose();
    }
    return out;
  }
  std::array<Eigen::Vector3d, 3> p;
  for (int c = 0; c < 3; ++c) {
    p[c] = garment.mesh.vertices.row(garment.mesh.faces(face, c)).transpose();
  }
  const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(normal);
  if (x.norm() < 1e-3) {
    x = Eigen::Vector3d::UnitX() - normal.x() * normal;
  }
  x.normalize();
  const Eigen::Vector3d y = normal.cross(x);
  for (int c = 0; c < 3; ++c) {
    out[c] = {x.dot(p[c] - p[0]), y.dot(p[c] - p[0])};
  }
  return out;
}

int corner_of(const Triangles& faces, Index face, int vertex) {
  for (int c = 0; c < 3; ++c) {
    if (faces(face, c) == vertex) {
      return c;
    }
  }
  return 0;
}

/// The slope that height 1/2 (n . x)^2 at the corners gives a face, along the unit vector `across`.
double slope(const FlatCorners& face, int origin, const Eigen::Vector2d& direction,
             const Eigen::Vector2d& across) {
  const auto height = [&](int c) {
    const double s = direction.dot(face[c] - face[origin]);
    return 0.5 * s * s;
  };
  const int i = (origin + 1) % 3;
  const int j = (origin + 2) % 3;
  const Eigen::Vector2d e1 = face[i] - face[origin];
  const Eigen::Vector2d e2 = face[j] - face[origin];
  const double det = e1.x() * e2.y() - e1.y() * e2.x();
  const Eigen::Vector2d gradient((height(i) * e2.y() - height(j) * e1.y()) / det,
                                 (height(j) * e1.x() - height(i) * e2.x()) / det);
  return gradient.dot(across);
}

}  // namespace

BendingRigidity bending_rigidity(const Garment& garment, int directions,
                                 const ClothOptions& options) {
  ATELIER_CHECK(directions >= 1 && directions <= 360, "directions in [1, 360]");
  Garment stiff = garment;
  stiff.material.bending = 1;
  const Cloth cloth = make_cloth(stiff, {}, options);
  const Triangles& faces = cloth.faces;

  // Faces of each hinge: those that hold its edge, in the direction that the hinge says.
  const auto key = [](int a, int b) { return (static_cast<std::int64_t>(a) << 32) | b; };
  std::unordered_map<std::int64_t, Index> face_of;
  for (Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      face_of[key(faces(f, c), faces(f, (c + 1) % 3))] = f;
    }
  }
  std::vector<int> hinge_count(static_cast<std::size_t>(faces.rows()), 0);
  std::vector<std::array<Index, 2>> sides;
  for (const ClothHinge& hinge : cloth.hinges) {
    sides.push_back(
        {face_of[key(hinge.edge0, hinge.edge1)], face_of[key(hinge.edge1, hinge.edge0)]});
    ++hinge_count[sides.back()[0]];
    ++hinge_count[sides.back()[1]];
  }
  std::vector<FlatCorners> flat(static_cast<std::size_t>(faces.rows()));
  double area = 0;
  for (Index f = 0; f < faces.rows(); ++f) {
    flat[f] = flat_corners(garment, f);
    const Eigen::Vector2d e1 = flat[f][1] - flat[f][0];
    const Eigen::Vector2d e2 = flat[f][2] - flat[f][0];
    area += hinge_count[f] == 3 ? 0.5 * std::abs(e1.x() * e2.y() - e1.y() * e2.x()) : 0;
  }
  BendingRigidity out;
  out.by_direction.assign(static_cast<std::size_t>(directions), 0.0);
  if (!(area > 0)) {
    return out;
  }
  for (int d = 0; d < directions; ++d) {
    const double angle = std::numbers::pi * d / directions;
    double energy = 0;
    for (std::size_t h = 0; h < sides.size(); ++h) {
      double jump = 0;
      for (int side = 0; side < 2; ++side) {
        const FlatCorners& face = flat[sides[h][side]];
        const int origin = corner_of(faces, sides[h][side], cloth.hinges[h].edge0);
        const int other = corner_of(faces, sides[h][side], cloth.hinges[h].edge1);
        const Eigen::Vector2d edge = (face[other] - face[origin]).normalized();
        // A pattern may hold its panels mirrored: across is always the left of the edge, as seen.
        const Eigen::Vector2d across(-edge.y(), edge.x());
        const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
        jump += (side == 0 ? 1 : -1) * slope(face, origin, direction, across);
      }
      const int counted =
          (hinge_count[sides[h][0]] == 3 ? 1 : 0) + (hinge_count[sides[h][1]] == 3 ? 1 : 0);
      energy += 0.25 * counted * cloth.hinges[h].stiffness * jump * jump;
    }
    out.by_direction[d] = energy / (0.5 * area);
    out.mean += out.by_direction[d] / directions;
  }
  out.lowest = *std::min_element(out.by_direction.begin(), out.by_direction.end());
  out.highest = *std::max_element(out.by_direction.begin(), out.by_direction.end());
  return out;
}

}  // namespace atelier
