#pragma once

#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/skeleton.h"

namespace atelier {

/// Offsets of some vertices of a mesh.
struct Blendshape {
  std::vector<int> vertices;  ///< [N] which vertices, increasing; empty: all V in order
  Points offsets;             ///< [N,3] or [V,3] metres per unit of the weight it is scaled by
};

/// One number that shapes a body. A shape is a vector of values, one per parameter, each in its
/// parameter's own unit, so that a stature of 1.75 m is written 1.75.
struct ShapeParameter {
  std::string name;    ///< unique snake_case: "stature", "beta_0"
  std::string unit;    ///< "m", "kg", "sd" (standard deviations), "" for a fraction
  double neutral = 0;  ///< value of the unchanged template
  double min = -3;     ///< plausible range, checked where users set shapes
  double max = 3;
  Blendshape surface;  ///< change of the rest vertices per unit above `neutral`
  Points joints;       ///< [J,3] metres, change of the joints' rest positions per unit, world axes
};

/// The function of a joint's rotation r (rotation vector, angle t about axis a) that drives a pose
/// corrective.
enum class PoseFeature {
  RotationEntry,    ///< entry `component` (row-major, 0..8) of R(r) - I: SMPL, SMPL-H, SMPL-X
  QuaternionEntry,  ///< entry `component` (0..3) of (x, y, z, w - 1) of r's quaternion: STAR
  Bend,             ///< 2 max(0, sin(t/2) a . axis)^2: 0 at rest, 1 at 90 degrees about `axis`,
                    ///< 1 - cos(t) between, 0 on the other side; once differentiable
};

/// A blendshape driven by a joint's rotation and added to the rest vertices before skinning. The
/// surface is linear in the features, which suffices for SMPL, STAR and our default human.
struct PoseCorrective {
  int joint = 0;
  PoseFeature feature = PoseFeature::RotationEntry;
  int component = 0;                                ///< of RotationEntry and QuaternionEntry
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< of Bend, unit length, joint's rest frame
  Blendshape surface;                               ///< offsets per unit of the feature
};

/// Skinning weights: the joints that move a vertex, and how much. Every vertex has K slots, the
/// maximum that any vertex needs; unused slots have weight 0.
struct SkinWeights {
  Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joints;  ///< [V,K]
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>
      weights;  ///< [V,K] >= 0,
                ///< rows sum to 1
};

/// A joint's rest position as a weighted sum of vertices; one row of a sparse matrix.
struct JointRegressor {
  std::vector<int> vertices;    ///< [N], increasing
  std::vector<double> weights;  ///< [N]; sum to 1 in most models
};

/// Named vertices: body regions, landmarks, rings.
struct VertexGroup {
  std::string name;
  std::vector<int> vertices;  ///< ordered where order has a meaning (a ring)
};

/// A parametric body: linear shape space, tree of joints, linear blend skinning with optional pose
/// correctives. SMPL (Loper et al. 2015), STAR (Osman et al. 2020), MakeHuman, glTF skins and the
/// default human are all of this form. Rest vertices and joints share one frame: metres, Y up,
/// facing +Z.
///   rest vertices(shape, pose) = template + sum_s (shape_s - neutral_s) surface_s
///                                         + sum_c feature_c(pose) surface_c
///   rest joints(shape)         = joints of the skeleton + sum_s (shape_s - neutral_s) joints_s
struct BodyModel {
  std::string name;
  Skeleton skeleton;  ///< rest pose at the neutral shape
  Mesh mesh;          ///< template at the neutral shape, rest pose
  SkinWeights skin;
  std::vector<ShapeParameter> shape;  ///< [S]
  std::vector<PoseCorrective> correctives;
  std::vector<JointRegressor> regressor;  ///< [J], or empty: joints follow `shape` alone
  std::vector<VertexGroup> groups;
};

/// Numbers of joints and vertices.
Index joint_count(const BodyModel& model);
Index vertex_count(const BodyModel& model);

/// The neutral value of every parameter, [S].
Eigen::VectorXd neutral_shape(const BodyModel& model);

/// Index of a shape parameter by name, -1 if there is none.
int find_shape(const BodyModel& model, const std::string& name);

/// Throws DataError (with `file` as its file) unless the skeleton and the mesh are valid, every
/// array has the stated rows, indices are in range, numbers are finite, names are unique, ranges
/// include their neutral value, axes have unit length, and weights are non-negative with rows that
/// sum to 1 within 1e-6. Cost: one pass.
void check_body_model(const BodyModel& model, const std::string& file = "");

/// Throws LogicError unless `shape` has S finite values (or is empty, which means neutral).
void check_shape(const BodyModel& model, const Eigen::VectorXd& shape);

}  // namespace atelier
