#include "bodymodel/tracking/thickness.h"

#include <utility>
#include <vector>

#include "bodymodel/humanoid.h"
#include "bodymodel/kinematics.h"
#include "core/normals.h"

namespace atelier {
namespace {

using Axis = std::pair<int, int>;  // from one joint to another

/// Body parts with a girth, both sides as one.
std::vector<std::vector<Axis>> girded_parts(const Humanoid& who) {
  const auto& [left, right] = who.legs;
  const auto& [arm, other] = who.arms;
  return {{{who.spine.front(), who.neck.front()}},
          {{who.neck.front(), who.neck.back()}},
          {{left.hip, left.knee}, {right.hip, right.knee}},
          {{left.knee, left.ankle}, {right.knee, right.ankle}},
          {{arm.shoulder, arm.elbow}, {other.shoulder, other.elbow}},
          {{arm.elbow, arm.wrist}, {other.elbow, other.wrist}}};
}

/// Vertices that the joints of an axis, all but its last, move most.
std::vector<Index> skin_of(const BodyModel& model, const Axis& axis) {
  std::vector<char> on_axis(model.skeleton.parents.size(), 0);
  for (int j = axis.second; j >= 0 && j != axis.first;) {
    j = model.skeleton.parents[static_cast<std::size_t>(j)];
    if (j >= 0) {
      on_axis[static_cast<std::size_t>(j)] = 1;
    }
  }
  std::vector<Index> skin;
  for (Index v = 0; v < vertex_count(model); ++v) {
    Index slot = 0;
    model.skin.weights.row(v).maxCoeff(&slot);
    if (on_axis[static_cast<std::size_t>(model.skin.joints(v, slot))] != 0) {
      skin.push_back(v);
    }
  }
  return skin;
}

/// Displacement of every vertex by a unit of each parameter: [3V,S].
Eigen::MatrixXd skin_moves(const BodyModel& model) {
  Eigen::MatrixXd moves =
      Eigen::MatrixXd::Zero(3 * vertex_count(model), static_cast<Index>(model.shape.size()));
  for (std::size_t s = 0; s < model.shape.size(); ++s) {
    const Blendshape& surface = model.shape[s].surface;
    for (Index i = 0; i < surface.offsets.rows(); ++i) {
      const Index v = surface.vertices.empty() ? i : surface.vertices[static_cast<std::size_t>(i)];
      moves.block<3, 1>(3 * v, static_cast<Index>(s)) = surface.offsets.row(i).transpose();
    }
  }
  return moves;
}

/// Displacement of a joint by a unit of each: [3,S].
Eigen::MatrixXd joint_moves(const BodyModel& model, int joint) {
  Eigen::MatrixXd moves(3, static_cast<Index>(model.shape.size()));
  for (Index s = 0; s < moves.cols(); ++s) {
    moves.col(s) = model.shape[static_cast<std::size_t>(s)].joints.row(joint).transpose();
  }
  return moves;
}

}  // namespace

Eigen::MatrixXd thickness_change(const BodyModel& model) {
  const Points& skin = model.mesh.vertices;
  const Points joints = rest_positions(model.skeleton);
  const Eigen::VectorXd areas = vertex_areas(skin, model.mesh.faces);
  const Eigen::MatrixXd moves = skin_moves(model);
  Index top = 0;
  Index sole = 0;
  const double stature = skin.col(1).maxCoeff(&top) - skin.col(1).minCoeff(&sole);
  const Eigen::RowVectorXd usual = (moves.row(3 * top + 1) - moves.row(3 * sole + 1)) / stature / 2;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(moves.cols(), moves.cols());
  for (const std::vector<Axis>& part : girded_parts(recognised_humanoid(model.skeleton))) {
    double distances = 0;  // squared, weighted by area, as the changes are
    Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(moves.cols(), moves.cols());
    for (const auto& [first, second] : part) {
      if (first < 0 || second < 0) {
        continue;
      }
      const Eigen::Vector3d from = joints.row(first).transpose();
      const Eigen::Vector3d along = joints.row(second).transpose() - from;
      if (!(along.norm() > 1e-6)) {
        continue;
      }
      const Eigen::MatrixXd from_moves = joint_moves(model, first);
      const Eigen::MatrixXd along_moves = joint_moves(model, second) - from_moves;
      for (const Index v : skin_of(model, {first, second})) {
        const Eigen::Vector3d off = skin.row(v).transpose() - from;
        const double share = off.dot(along) / along.squaredNorm();
        const Eigen::Vector3d across = off - share * along;
        const Eigen::RowVectorXd change =
            across.normalized().transpose() *
                (moves.middleRows<3>(3 * v) - from_moves - share * along_moves) -
            across.norm() * usual;
        distances += areas[v] * across.squaredNorm();
        changes += areas[v] * change.transpose() * change;
      }
    }
    if (distances > 0) {
      sum += changes / distances;
    }
  }
  return sum;
}

}  // namespace atelier
