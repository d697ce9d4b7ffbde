#include "pipeline/avatar/shoe_soles.h"

#include <Eigen/SVD>
#include <array>
#include <vector>

#include "bodymodel/humanoid.h"
#include "bodymodel/underlying/shoe_sole.h"
#include "core/label.h"
#include "pipeline/avatar/moved_vertices.h"

namespace atelier {
namespace {

Points rows_of(const Points& all, const std::vector<Index>& which) {
  Points rows(static_cast<Index>(which.size()), 3);
  for (std::size_t i = 0; i < which.size(); ++i) {
    rows.row(static_cast<Index>(i)) = all.row(which[i]);
  }
  return rows;
}

/// How a foot stands: by the turn that brings it nearest from its rest pose (Kabsch 1976), in which
/// y is up and z forward.
ShoeAxes axes_of(const Points& rest, const Points& posed) {
  const Eigen::RowVector3d from = rest.colwise().mean();
  const Eigen::RowVector3d to = posed.colwise().mean();
  const Eigen::Matrix3d covariance = (rest.rowwise() - from).transpose() * (posed.rowwise() - to);
  const Eigen::JacobiSVD<Eigen::Matrix3d> parts(covariance,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  sign(2, 2) = (parts.matrixV() * parts.matrixU().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d turn = parts.matrixV() * sign * parts.matrixU().transpose();
  return {-turn.col(1), turn.col(2)};
}

void append(ClothedScan& scan, const Mesh& sole) {
  scan.mesh.colors.resize(0, 3);  // of which a sole has none
  scan.mesh.normals.resize(0, 3);
  scan.mesh.confidence.resize(0);
  const Index vertices = scan.mesh.vertices.rows();
  const Index faces = scan.mesh.faces.rows();
  scan.mesh.vertices.conservativeResize(vertices + sole.vertices.rows(), 3);
  scan.mesh.vertices.bottomRows(sole.vertices.rows()) = sole.vertices;
  scan.mesh.faces.conservativeResize(faces + sole.faces.rows(), 3);
  scan.mesh.faces.bottomRows(sole.faces.rows()) =
      (sole.faces.array() + static_cast<int>(vertices)).matrix();
  scan.mesh.labels.resize(static_cast<std::size_t>(scan.mesh.vertices.rows()),
                          static_cast<std::uint8_t>(Label::Shoes));
  scan.roles.resize(static_cast<std::size_t>(scan.mesh.vertices.rows()), ScanRole::Cover);
}

}  // namespace

void add_soles(ClothedScan& scan, const BodyModel& person, const Points& body) {
  const auto legs = find_humanoid(person.skeleton);
  if (!legs || scan.mesh.labels.empty()) {
    return;
  }
  std::array<std::vector<Index>, 2> feet;
  std::array<Points, 2> posed;
  for (std::size_t side = 0; side < 2; ++side) {
    feet[side] = vertices_moved_below(person, legs->legs[side].ankle);
    posed[side] = rows_of(body, feet[side]);
    if (feet[side].empty()) {
      return;
    }
  }
  constexpr double kReach = 0.15;  // m between a shoe and the foot in it
  std::array<std::vector<Index>, 2> shoes;
  for (Index v = 0; v < scan.mesh.vertices.rows(); ++v) {
    if (static_cast<Label>(scan.mesh.labels[static_cast<std::size_t>(v)]) != Label::Shoes) {
      continue;
    }
    std::array<double, 2> distance{};
    for (std::size_t side = 0; side < 2; ++side) {
      distance[side] =
          (posed[side].rowwise() - scan.mesh.vertices.row(v)).rowwise().squaredNorm().minCoeff();
    }
    const std::size_t nearer = distance[1] < distance[0] ? 1 : 0;
    if (distance[nearer] < kReach * kReach) {
      shoes[nearer].push_back(v);
    }
  }
  for (std::size_t side = 0; side < 2; ++side) {
    append(scan, shoe_sole(rows_of(scan.mesh.vertices, shoes[side]),
                           axes_of(rows_of(person.mesh.vertices, feet[side]), posed[side])));
  }
}

}  // namespace atelier
