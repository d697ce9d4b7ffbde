// What shape values do to the thickness of a person.
#include "bodymodel/tracking/thickness.h"

#include <gtest/gtest.h>

#include "bodymodel/bone_lengths.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "tests/bodymodel_tracking/posed_person.h"

namespace atelier::fixtures {
namespace {

/// The change by one value alone.
double change_by(const BodyModel& model, const char* name, double more) {
  const Eigen::MatrixXd change = thickness_change(model);
  const Index s = find_shape(model, name);
  return more * more * change(s, s);
}

TEST(Thickness, Size_ScalesWithTheRootOfStature) {
  // A tenth more of everything is a tenth thicker, where half of that is usual: in all six parts.
  EXPECT_NEAR(change_by(with_bone_lengths(plain_human()), "size", 0.1), 6 * 0.05 * 0.05, 1e-9);
}

TEST(Thickness, LongerBones_AreNotThicker) {
  const BodyModel model = with_bone_lengths(plain_human());
  for (const ShapeParameter& bone : model.shape) {
    if (bone.name != "size") {
      EXPECT_LT(change_by(model, bone.name.c_str(), bone.max), 6 * 0.01 * 0.01) << bone.name;
    }
  }
}

TEST(Thickness, ThickerShins_AreMeasured) {
  BodyModel model = plain_human();
  const Points joints = rest_positions(model.skeleton);
  ShapeParameter thick{"shins",
                       "",
                       0,
                       -1,
                       1,
                       {{}, Points::Zero(vertex_count(model), 3)},
                       Points::Zero(joint_count(model), 3)};
  for (Index v = 0; v < vertex_count(model); ++v) {
    Index slot = 0;
    model.skin.weights.row(v).maxCoeff(&slot);
    for (const auto& [from, to] :
         {std::pair("left_knee", "left_ankle"), {"right_knee", "right_ankle"}}) {
      const int knee = find_joint(model.skeleton, from);
      if (model.skin.joints(v, slot) == knee) {
        const Eigen::RowVector3d along =
            (joints.row(find_joint(model.skeleton, to)) - joints.row(knee)).normalized();
        const Eigen::RowVector3d off = model.mesh.vertices.row(v) - joints.row(knee);
        thick.surface.offsets.row(v) = off - off.dot(along) * along;
      }
    }
  }
  model.shape.push_back(thick);
  EXPECT_NEAR(change_by(model, "shins", 0.1), 0.01, 1e-9);
}

TEST(Thickness, MassAtGivenGirths_ThickensUngivenParts) {
  const BodyModel model = default_human();
  // Ten kilograms less are two fifths of the calves' and forearms' girths.
  EXPECT_GT(change_by(model, "mass", 10), 2 * 0.2 * 0.2);
  EXPECT_LT(change_by(model, "arm_length", 0.02), 6 * 0.02 * 0.02);
}

TEST(Thickness, NonHumanSkeleton_Throws) {
  BodyModel model = with_bone_lengths(plain_human());
  for (std::size_t j = 0; j < model.skeleton.names.size(); ++j) {
    model.skeleton.names[j] = "b" + std::to_string(j);
    model.skeleton.parents[j] = static_cast<int>(j) - 1;
  }
  EXPECT_THROW(thickness_change(model), DataError);
}

}  // namespace
}  // namespace atelier::fixtures
