#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning_jacobian.h"
#include "core/normals.h"
#include "core/tree.h"
#include "tests/support/joint_positions_jacobian.h"

namespace atelier::fixtures {

/// A default human in the shape and pose that lie nearest to a surface.
struct SurfaceFit {
  BodyModel model;
  Pose pose;
  Points vertices;
};

/// Where joints of the target are, by our names.
using JointHints = std::map<std::string, Eigen::Vector3d>;

namespace detail {

struct Unknowns {
  Pose pose;
  Eigen::VectorXd shape;
};

inline void step_joints(const BodyModel& model, const JointHints& hints, Unknowns& x) {
  const Skeleton skeleton = shaped_skeleton(model, x.shape);
  const JointFrames frames = forward_kinematics(skeleton, x.pose);
  const Eigen::MatrixXd by_pose = fixtures::joint_positions_jacobian(skeleton, x.pose);
  const Eigen::MatrixXd by_shape = joint_positions_shape_jacobian(model, frames);
  const Index poses = by_pose.cols();
  const Index shapes = by_shape.cols();
  Eigen::MatrixXd jacobian(by_pose.rows(), poses + shapes);
  jacobian << by_pose, by_shape;
  Eigen::VectorXd prior = Eigen::VectorXd::Constant(poses + shapes, 2e-4);
  prior.head(3).setConstant(1e-8);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(poses + shapes);
  const Eigen::VectorXd now = pose_vector(x.pose);
  right.head(poses) = -prior.head(poses).cwiseProduct(now);
  right.head(3).setZero();
  for (Index s = 0; s < shapes; ++s) {
    const ShapeParameter& p = model.shape[s];
    prior[poses + s] = 4e-5 * std::pow(6 / (p.max - p.min), 2);
    right[poses + s] = -prior[poses + s] * (x.shape[s] - p.neutral);
  }
  Eigen::MatrixXd normal = prior.asDiagonal();
  for (const auto& [name, position] : hints) {
    const Index j = find_joint(model.skeleton, name);
    const Eigen::Vector3d gap = position - frames.positions.row(j).transpose();
    const Eigen::MatrixXd rows = jacobian.middleRows(3 * j, 3);
    normal += rows.transpose() * rows;
    right += rows.transpose() * gap;
  }
  const Eigen::VectorXd move = normal.ldlt().solve(right);
  x.pose = pose_of_vector(now + move.head(poses));
  x.shape += move.tail(shapes);
}

inline void step_surface(const BodyModel& model, const SkinChains& chains, const TriangleTree& tree,
                         const Points& target_normals, bool shape_too, double reach,
                         const Eigen::VectorXd& pose_start, Unknowns& x) {
  const ShapedBody body = shape_body(model, x.shape);
  const PosedBody posed = pose_body(model, body, x.pose, false);
  const Points normals = vertex_normals(posed.vertices, model.mesh.faces);
  std::vector<int> rows;
  std::vector<Eigen::Vector3d> directions;
  std::vector<double> gaps;
  const std::vector<ClosestPoint> closest = closest_points(tree, posed.vertices, reach);
  for (Index v = 0; v < posed.vertices.rows(); ++v) {
    const ClosestPoint& c = closest[v];
    if (c.face < 0) {
      continue;
    }
    const Eigen::Vector3d n = target_normals.row(c.face);
    if (n.dot(normals.row(v)) < 0.4) {
      continue;
    }
    rows.push_back(static_cast<int>(v));
    directions.push_back(n);
    gaps.push_back(n.dot(c.point - posed.vertices.row(v).transpose()));
  }
  Points direction_rows(static_cast<Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    direction_rows.row(static_cast<Index>(i)) = directions[i].transpose();
  }
  const SkinRows by_pose = skin_jacobian_rows(model, posed, chains, rows, direction_rows);
  const Index joints = joint_count(model);
  const Index poses = 3 + 3 * joints;
  const Index shapes = shape_too ? x.shape.size() : 0;
  const Eigen::MatrixXd by_shape =
      shape_too ? skin_shape_rows(model, body, posed, rows, direction_rows) : Eigen::MatrixXd();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(poses + shapes, poses + shapes);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(poses + shapes);
  std::vector<Index> columns;
  std::vector<double> values;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    columns.clear();
    values.clear();
    const auto push = [&](Index c, double value) {
      columns.push_back(c);
      values.push_back(value);
    };
    for (int d = 0; d < 3; ++d) {
      push(d, directions[i][d]);
    }
    for (int k = by_pose.begin[i]; k < by_pose.begin[i + 1]; ++k) {
      for (int d = 0; d < 3; ++d) {
        push(3 + 3 * by_pose.joints[k] + d, by_pose.values(k, d));
      }
    }
    for (Index s = 0; s < shapes; ++s) {
      push(poses + s, by_shape(static_cast<Index>(i), s));
    }
    const double weight = 1 / (1 + std::pow(gaps[i] / 0.02, 2));  // Geman-McClure-like
    for (std::size_t a = 0; a < columns.size(); ++a) {
      right[columns[a]] += weight * values[a] * gaps[i];
      for (std::size_t b = 0; b < columns.size(); ++b) {
        normal(columns[a], columns[b]) += weight * values[a] * values[b];
      }
    }
  }
  // Priors: joints near where the joint hints left them, shapes near the middle of their range.
  const Eigen::VectorXd now = pose_vector(x.pose);
  for (Index c = 3; c < poses; ++c) {
    const std::string& name = model.skeleton.names[(c - 3) / 3];
    const bool small = name.find("spine") != std::string::npos ||
                       name.find("collar") != std::string::npos ||
                       name.find("eye") != std::string::npos || name == "jaw" || name.back() <= '9';
    const double w = small ? 0.05 : 0.01;
    normal(c, c) += w;
    right[c] -= w * (now[c] - pose_start[c]);
  }
  for (Index s = 0; s < shapes; ++s) {
    const ShapeParameter& p = model.shape[s];
    const double range = p.max - p.min;
    const double w = 0.01 / (range * range);
    normal(poses + s, poses + s) += w;
    right[poses + s] -= w * (x.shape[s] - p.neutral);
  }
  const Eigen::VectorXd move = normal.ldlt().solve(right);
  x.pose = pose_of_vector(now + move.head(poses));
  if (shape_too) {
    x.shape += move.tail(shapes);
    const Index male = find_shape(model, "male");
    x.shape[male] = std::clamp(x.shape[male], 0.0, 1.0);
  }
}

}  // namespace detail

/// Fits shape and pose: joints first, then points to planes, and the generator at the shape found,
/// so that the result is a default human, not a point of its linear space.
inline SurfaceFit fit_default_human(const Mesh& target, const JointHints& hints,
                                    DefaultHumanOptions options, int rounds = 3) {
  const TriangleTree tree = build_tree(target.vertices, target.faces);
  const Points normals = face_normals(target.vertices, target.faces);
  detail::Unknowns x;
  SurfaceFit fit;
  for (int round = 0; round < rounds; ++round) {
    fit.model = default_human(options);
    x.shape = neutral_shape(fit.model);
    if (round == 0) {
      x.pose = rest_pose(fit.model.skeleton);
    }
    for (int step = 0; step < (round == 0 ? 20 : 0); ++step) {
      detail::step_joints(fit.model, hints, x);
    }
    const Eigen::VectorXd start = pose_vector(x.pose);
    const SkinChains chains = skin_chains(fit.model, false);
    const bool last = round + 1 == rounds;
    for (int step = 0; step < 8; ++step) {
      detail::step_surface(fit.model, chains, tree, normals, !last && step >= 2,
                           round == 0 && step < 4 ? 0.08 : 0.04, start, x);
    }
    if (!last) {
      for (const ShapeParameter& p : fit.model.shape) {
        const double value = x.shape[find_shape(fit.model, p.name)];
        OptionTable table = describe(options);
        for (OptionField& field : table.fields) {
          if (field.name == p.name) {
            *std::get<double*>(field.target) = value;
          }
        }
      }
    }
  }
  fit.pose = x.pose;
  fit.vertices = skin_vertices(fit.model, x.pose);
  return fit;
}

}  // namespace atelier::fixtures
