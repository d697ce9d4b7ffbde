#include "bodymodel/unpose.h"

#include <Eigen/LU>

#include "bodymodel/kinematics.h"
#include "core/error.h"

namespace atelier {

Points unposed_vertices(const BodyModel& model, const ShapedBody& body, const Pose& pose,
                        const Points& posed) {
  ATELIER_CHECK(
      posed.rows() == body.vertices.rows() && model.skin.joints.rows() == body.vertices.rows(),
      "posed vertices of another body");
  using Transform = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  constexpr double kFlat = 0.05;
  const std::vector<SkinTransform> transforms =
      skin_transforms(body, forward_kinematics(body.skeleton, pose));
  Points rest = body.vertices;
  for (Index v = 0; v < rest.rows(); ++v) {
    Transform blend = Transform::Zero();
    for (Index k = 0; k < model.skin.joints.cols(); ++k) {
      const auto joint = static_cast<std::size_t>(model.skin.joints(v, k));
      blend += model.skin.weights(v, k) * Eigen::Map<const Transform>(transforms[joint].m);
    }
    const Eigen::Matrix3d linear = blend.leftCols<3>();
    if (linear.determinant() > kFlat) {
      rest.row(v) = (linear.inverse() * (posed.row(v).transpose() - blend.col(3))).transpose();
    }
  }
  return rest;
}

}  // namespace atelier
