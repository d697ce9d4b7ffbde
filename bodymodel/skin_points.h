#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "bodymodel/skinning_jacobian.h"
#include "core/tensor.h"
#include "core/vec.h"

namespace atelier {

/// Points on faces of a body, by corners and barycentric coordinates.
struct FacePoints {
  std::vector<std::array<int, 3>> vertices;  ///< [R]
  Points barycentric;                        ///< [R,3]
};

/// Points on faces, ready to be posed and differentiated at many poses, as an optimisation does
/// between two searches for matches. Those that hang on the same joints stand together, so that
/// their rows are one dense matrix and add up to one small normal matrix.
struct SkinPoints {
  /// Points that hang on the same sought joints.
  struct Chain {
    std::vector<int> joints;  ///< increasing, so that parents come first
    std::vector<int> slots;   ///< which of the sought joints each of them is, increasing
    std::vector<int> above;   ///< place in `joints` of the next one above, -1: none
    int begin = 0;            ///< points [begin, end) in the order of `order`
    int end = 0;
  };
  /// A joint that skins a point: with how much, and which joint of the chain turns it (-1: none).
  struct Bone {
    int joint = 0;
    int place = -1;
    double weight = 0;
  };
  /// A vertex's share in one of its point's bones.
  struct Term {
    int bone = 0;  ///< of the point's
    double share = 0;
  };
  /// Displacement of a vertex by a corrective, per unit of its feature.
  struct Corrective {
    int corrective = 0;
    int joint = 0;  ///< whose rotation it follows
    Vec3d offset{0, 0, 0};
  };
  std::vector<Chain> chains;
  std::vector<int> order;       ///< [R] which point
  std::vector<int> bone_begin;  ///< [R+1] in that order
  std::vector<Bone> bones;
  std::vector<int> corner_begin;  ///< [R+1] in that order
  std::vector<int> corners;       ///< into `vertices`; corners that count nothing left out
  std::vector<int> term_begin;    ///< [corners+1]
  std::vector<Term> terms;
  std::vector<int> vertices;            ///< that any point hangs on
  std::vector<int> corrective_begin;    ///< [vertices+1]
  std::vector<Corrective> correctives;  ///< by vertex
};

/// @param slots  [J] which column block each joint's rotation has, increasing with joints, -1 for
///               joints that are held
/// @param chains with the correctives that poses will have
/// Throws LogicError for vertices out of range, chains or slots of another model.
SkinPoints skin_points(const BodyModel& model, const SkinChains& chains,
                       const std::vector<int>& slots, const FacePoints& points);

/// The points of one chain at a pose.
struct ChainRows {
  const SkinPoints::Chain& chain;
  std::span<const int> points;  ///< [m] which ones
  const Points& places;         ///< [m,3] metres
  const RowMatrix& rows;        ///< [m,3+3L] derivative of direction . place by the root's
                                ///< translation and by the rotations of the chain's joints; empty
                                ///< unless asked for
};

/// Poses the points and hands them over chain by chain, always in the same order. Exact: what
/// `skin_vertices` and `skin_jacobian_rows` give for the corners, added up. `posed` needs no
/// vertices (pose_joints). O(R x chain).
/// @param directions  [R,3], or none: places alone
void visit_skin_points(const ShapedBody& body, const PosedBody& posed, const SkinPoints& points,
                       const Points& directions,
                       const std::function<void(const ChainRows&)>& visit);

}  // namespace atelier
