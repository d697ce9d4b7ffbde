#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bodymodel/skinning.h"

namespace atelier {

/// Everything that the vertices of one pose and their derivatives share. Linear skinning.
struct PosedBody {
  JointFrames frames;
  std::vector<Eigen::Matrix3d> bases;     ///< [J] joint_velocity_bases
  std::vector<SkinTransform> transforms;  ///< [J]
  Points rest;                            ///< [V,3] corrected rest vertices, metres
  Points vertices;                        ///< [V,3] posed vertices, metres
  Eigen::VectorXd features;               ///< [C], or empty without correctives
  Points feature_gradient;                ///< [C,3], or empty without correctives
  Eigen::MatrixXd joint_shape;            ///< [3J,S] derivative of `frames.positions`
};

/// Poses the joints of a shaped body and keeps what derivatives need; no vertices. O(J + C).
PosedBody pose_joints(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                      bool correctives = true);

/// The same with vertices. O(V K + V C).
PosedBody pose_body(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                    bool correctives = true);

/// For every vertex, the joints whose rotation moves it: the chains above its slots, and with
/// correctives the joints that trigger one there. Made once for a model. Compressed rows.
struct SkinChains {
  std::vector<int> begin;             ///< [V+1] into joints and slots
  std::vector<int> joints;            ///< [N] increasing within a vertex
  std::vector<std::uint32_t> slots;   ///< [N] bit k: slot k of the vertex hangs on the joint
  std::vector<int> alike;             ///< [V] equal where the same joints move vertices
  std::vector<int> corrective_begin;  ///< [N+1] into the two below
  std::vector<int> correctives;       ///< [M] corrective of the joint that acts on the vertex
  std::vector<int> corrective_rows;   ///< [M] its row for the vertex
};

/// Throws LogicError for more than 32 slots. Trackers that can live with an approximate Jacobian
/// leave the correctives out: rows get as short as the chains are.
SkinChains skin_chains(const BodyModel& model, bool correctives = true);

/// Sparse rows: row i is the derivative of directions[i] . x(vertices[i]).
struct SkinRows {
  std::vector<int> begin;   ///< [R+1] into joints and values
  std::vector<int> joints;  ///< [N] which joint's rotation
  Points values;            ///< [N,3] derivative by that rotation vector; by the root's
                            ///< translation it is directions[i] itself
};

/// Derivatives by pose of the signed distances (or any projections) that trackers minimise. A point
/// on a triangle is three rows with directions scaled by its barycentric coordinates. O(chain) a
/// row. `vertices` [R], `directions` [R,3].
///   d x / d r_j = -[sum w_k x_k - (sum w_k) p_j]x W_j, sums over the slots k that hang on j
SkinRows skin_jacobian_rows(const BodyModel& model, const PosedBody& posed,
                            const SkinChains& chains, const std::vector<int>& vertices,
                            const Points& directions);

/// The same by shape, dense [R,S].
Eigen::MatrixXd skin_shape_rows(const BodyModel& model, const ShapedBody& body,
                                const PosedBody& posed, const std::vector<int>& vertices,
                                const Points& directions);

}  // namespace atelier
