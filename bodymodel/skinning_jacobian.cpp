#include "bodymodel/skinning_jacobian.h"

#include <algorithm>
#include <map>

#include "bodymodel/rotation.h"
#include "bodymodel/skinning_device.h"
#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr Index kRowsPerChunk = 256;
constexpr Index kMaxSlots = 32;

using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

Eigen::Map<const Matrix34> matrix(const SkinTransform& transform) {
  return Eigen::Map<const Matrix34>(transform.m);
}

// One corrective at one vertex.
struct Touch {
  int joint;
  int corrective;
  int row;
};

// For every vertex the correctives that act on it, ordered by joint.
std::vector<std::vector<Touch>> touches(const BodyModel& model) {
  std::vector<std::vector<Touch>> all(static_cast<std::size_t>(vertex_count(model)));
  for (std::size_t c = 0; c < model.correctives.size(); ++c) {
    const PoseCorrective& corrective = model.correctives[c];
    const Blendshape& shape = corrective.surface;
    for (Index row = 0; row < shape.offsets.rows(); ++row) {
      if (shape.offsets.row(row).isZero(0)) {
        continue;
      }
      const std::size_t vertex =
          shape.vertices.empty()
              ? static_cast<std::size_t>(row)
              : static_cast<std::size_t>(shape.vertices[static_cast<std::size_t>(row)]);
      all[vertex].push_back({corrective.joint, static_cast<int>(c), static_cast<int>(row)});
    }
  }
  for (std::vector<Touch>& list : all) {
    std::stable_sort(list.begin(), list.end(),
                     [](const Touch& a, const Touch& b) { return a.joint < b.joint; });
  }
  return all;
}

// The vertex's position by each slot alone, times the slot's weight, and the blended rotation.
struct SlotPoints {
  Eigen::Vector3d points[kMaxSlots];
  double weights[kMaxSlots];
};

/// Adds what the correctives of a chain's entry move along a direction at rest, by each component
/// of the joint's rotation.
void add_corrective_turns(const BodyModel& model, const PosedBody& posed, const SkinChains& chains,
                          std::size_t entry, const Eigen::Vector3d& direction_at_rest,
                          Eigen::Vector3d& sum) {
  for (int c = chains.corrective_begin[entry]; c < chains.corrective_begin[entry + 1]; ++c) {
    const int corrective = chains.correctives[static_cast<std::size_t>(c)];
    const Blendshape& shape = model.correctives[static_cast<std::size_t>(corrective)].surface;
    const double along = shape.offsets.row(chains.corrective_rows[static_cast<std::size_t>(c)])
                             .dot(direction_at_rest);
    sum += along * posed.feature_gradient.row(corrective).transpose();
  }
}

}  // namespace

PosedBody pose_joints(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                      bool correctives) {
  PosedBody posed;
  posed.frames = forward_kinematics(body.skeleton, pose);
  posed.bases = joint_velocity_bases(body.skeleton, pose, posed.frames);
  posed.transforms = skin_transforms(body, posed.frames);
  if (correctives && !model.correctives.empty()) {
    posed.features = pose_features(model, pose);
    posed.feature_gradient = pose_features_gradient(model, pose);
  }
  posed.joint_shape = joint_positions_shape_jacobian(model, posed.frames);
  return posed;
}

PosedBody pose_body(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                    bool correctives) {
  PosedBody posed = pose_joints(model, body, pose, correctives);
  posed.rest = posed.features.size() > 0 ? corrected_rest(model, body, pose) : body.vertices;
  posed.vertices = skin_linear_cpu(posed.rest, model.skin, posed.transforms, true);
  return posed;
}

SkinChains skin_chains(const BodyModel& model, bool correctives) {
  const Index slots = model.skin.weights.cols();
  ATELIER_CHECK(slots <= kMaxSlots, "at most 32 joints may move one vertex");
  const std::vector<std::vector<Touch>> touching =
      correctives ? touches(model)
                  : std::vector<std::vector<Touch>>(static_cast<std::size_t>(vertex_count(model)));
  SkinChains chains;
  chains.begin.push_back(0);
  chains.corrective_begin.push_back(0);
  std::vector<std::uint32_t> mask(static_cast<std::size_t>(joint_count(model)), 0);
  std::vector<int> chain;
  std::map<std::vector<int>, int> met;
  for (Index v = 0; v < vertex_count(model); ++v) {
    chain.clear();
    for (Index k = 0; k < slots; ++k) {
      if (model.skin.weights(v, k) == 0) {
        continue;
      }
      for (int j = model.skin.joints(v, k); j >= 0;
           j = model.skeleton.parents[static_cast<std::size_t>(j)]) {
        chain.push_back(j);
        mask[static_cast<std::size_t>(j)] |= 1u << k;
      }
    }
    const std::vector<Touch>& touch = touching[static_cast<std::size_t>(v)];
    for (const Touch& t : touch) {
      chain.push_back(t.joint);
    }
    std::sort(chain.begin(), chain.end());
    chain.erase(std::unique(chain.begin(), chain.end()), chain.end());
    chains.alike.push_back(met.try_emplace(chain, static_cast<int>(met.size())).first->second);
    std::size_t next = 0;
    for (const int j : chain) {
      chains.joints.push_back(j);
      chains.slots.push_back(mask[static_cast<std::size_t>(j)]);
      mask[static_cast<std::size_t>(j)] = 0;
      for (; next < touch.size() && touch[next].joint == j; ++next) {
        chains.correctives.push_back(touch[next].corrective);
        chains.corrective_rows.push_back(touch[next].row);
      }
      chains.corrective_begin.push_back(static_cast<int>(chains.correctives.size()));
    }
    chains.begin.push_back(static_cast<int>(chains.joints.size()));
  }
  return chains;
}

SkinRows skin_jacobian_rows(const BodyModel& model, const PosedBody& posed,
                            const SkinChains& chains, const std::vector<int>& vertices,
                            const Points& directions) {
  ATELIER_CHECK(directions.rows() == static_cast<Index>(vertices.size()),
                "one direction for each vertex");
  ATELIER_CHECK(static_cast<Index>(chains.begin.size()) == vertex_count(model) + 1,
                "chains of another model");
  SkinRows rows;
  rows.begin.reserve(vertices.size() + 1);
  rows.begin.push_back(0);
  for (const int vertex : vertices) {
    ATELIER_CHECK(vertex >= 0 && vertex < vertex_count(model),
                  "vertex " + std::to_string(vertex) + " out of range");
    const std::size_t v = static_cast<std::size_t>(vertex);
    rows.begin.push_back(rows.begin.back() + chains.begin[v + 1] - chains.begin[v]);
  }
  rows.joints.resize(static_cast<std::size_t>(rows.begin.back()));
  rows.values.resize(rows.begin.back(), 3);
  const bool correct = posed.feature_gradient.rows() > 0;
  const Index slots = model.skin.weights.cols();

  parallel_for(directions.rows(), kRowsPerChunk, [&](Index first, Index last) {
    SlotPoints slot;
    for (Index i = first; i < last; ++i) {
      const int vertex = vertices[static_cast<std::size_t>(i)];
      const Eigen::Vector3d direction = directions.row(i);
      const Eigen::Vector3d rest = posed.rest.row(vertex);
      Eigen::Vector3d direction_at_rest = Eigen::Vector3d::Zero();
      for (Index k = 0; k < slots; ++k) {
        const double weight = model.skin.weights(vertex, k);
        slot.weights[k] = weight;
        if (weight == 0) {
          slot.points[k].setZero();
          continue;
        }
        const auto m =
            matrix(posed.transforms[static_cast<std::size_t>(model.skin.joints(vertex, k))]);
        slot.points[k] = weight * (m.leftCols<3>() * rest + m.col(3));
        if (correct) {
          direction_at_rest += weight * (m.leftCols<3>().transpose() * direction);
        }
      }
      const int source = chains.begin[static_cast<std::size_t>(vertex)];
      const int begin = rows.begin[static_cast<std::size_t>(i)];
      const int count = rows.begin[static_cast<std::size_t>(i) + 1] - begin;
      for (int e = 0; e < count; ++e) {
        const std::size_t entry = static_cast<std::size_t>(source) + static_cast<std::size_t>(e);
        const std::size_t joint = static_cast<std::size_t>(chains.joints[entry]);
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        double mass = 0;
        for (std::uint32_t mask = chains.slots[entry], k = 0; mask != 0; mask >>= 1, ++k) {
          if (mask & 1u) {
            sum += slot.points[k];
            mass += slot.weights[k];
          }
        }
        const Eigen::Vector3d arm =
            sum - mass * posed.frames.positions.row(chains.joints[entry]).transpose();
        const Eigen::Vector3d turn(arm.y() * direction.z() - arm.z() * direction.y(),
                                   arm.z() * direction.x() - arm.x() * direction.z(),
                                   arm.x() * direction.y() - arm.y() * direction.x());
        Eigen::Vector3d value = posed.bases[joint].transpose() * turn;
        if (correct) {
          add_corrective_turns(model, posed, chains, entry, direction_at_rest, value);
        }
        rows.joints[static_cast<std::size_t>(begin) + static_cast<std::size_t>(e)] =
            static_cast<int>(joint);
        rows.values.row(begin + e) = value;
      }
    }
  });
  return rows;
}

Eigen::MatrixXd skin_shape_rows(const BodyModel& model, const ShapedBody& body,
                                const PosedBody& posed, const std::vector<int>& vertices,
                                const Points& directions) {
  ATELIER_CHECK(directions.rows() == static_cast<Index>(vertices.size()),
                "one direction for each vertex");
  const Index parameters = static_cast<Index>(model.shape.size());
  const Index slots = model.skin.weights.cols();
  // The part of joint j: d p_j - A_j d J_j, [3J, S].
  Eigen::MatrixXd joint_part = posed.joint_shape;
  for (Index j = 0; j < joint_count(model); ++j) {
    const Eigen::Matrix3d rotation = posed.frames.rotations[static_cast<std::size_t>(j)] *
                                     body.rest_rotations[static_cast<std::size_t>(j)].transpose();
    for (Index s = 0; s < parameters; ++s) {
      joint_part.block<3, 1>(3 * j, s) -=
          rotation * model.shape[static_cast<std::size_t>(s)].joints.row(j).transpose();
    }
  }
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(directions.rows(), parameters);
  for (Index i = 0; i < directions.rows(); ++i) {
    const int vertex = vertices[static_cast<std::size_t>(i)];
    ATELIER_CHECK(vertex >= 0 && vertex < vertex_count(model),
                  "vertex " + std::to_string(vertex) + " out of range");
    const Eigen::Vector3d direction = directions.row(i);
    Eigen::Vector3d direction_at_rest = Eigen::Vector3d::Zero();
    for (Index k = 0; k < slots; ++k) {
      const double weight = model.skin.weights(vertex, k);
      if (weight == 0) {
        continue;
      }
      const int joint = model.skin.joints(vertex, k);
      direction_at_rest +=
          weight *
          (matrix(posed.transforms[static_cast<std::size_t>(joint)]).leftCols<3>().transpose() *
           direction);
      rows.row(i) += weight * direction.transpose() * joint_part.middleRows<3>(3 * joint);
    }
    for (Index s = 0; s < parameters; ++s) {
      const Blendshape& surface = model.shape[static_cast<std::size_t>(s)].surface;
      Index row = vertex;
      if (!surface.vertices.empty()) {
        const auto found =
            std::lower_bound(surface.vertices.begin(), surface.vertices.end(), vertex);
        if (found == surface.vertices.end() || *found != vertex) {
          continue;
        }
        row = found - surface.vertices.begin();
      }
      rows(i, s) += surface.offsets.row(row).dot(direction_at_rest);
    }
  }
  return rows;
}

}  // namespace atelier
