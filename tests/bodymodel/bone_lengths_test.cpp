// Lengths of a person's bones as shape parameters of any body.
#include "bodymodel/bone_lengths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/test_data.h"

namespace atelier::fixtures {
namespace {

const BodyModel& human() {
  static const BodyModel model = [] {
    DefaultHumanOptions options;
    options.shape_basis = false;
    options.correctives = false;
    return default_human(options);
  }();
  return model;
}

Eigen::RowVector3d bone(const Skeleton& skeleton, const char* from, const char* to) {
  const Points rest = rest_positions(skeleton);
  return rest.row(find_joint(skeleton, to)) - rest.row(find_joint(skeleton, from));
}

/// The model with one bone 3 cm longer.
BodyModel longer(const BodyModel& model, const std::string& name) {
  const BodyModel bones = with_bone_lengths(model);
  Eigen::VectorXd shape = neutral_shape(bones);
  shape[find_shape(bones, name)] += 0.03;
  return at_shape(bones, shape);
}

TEST(BoneLengths, BoneLengthParameter_ChangesItsBoneOnly) {
  const struct {
    const char *name, *from, *to;
  } bones[] = {{"thigh_length", "left_hip", "left_knee"},
               {"shin_length", "right_knee", "right_ankle"},
               {"foot_length", "left_ankle", "left_foot"},
               {"upper_arm_length", "left_shoulder", "left_elbow"},
               {"forearm_length", "right_elbow", "right_wrist"},
               {"shoulder_breadth_half", "left_collar", "left_shoulder"},
               {"hip_breadth_half", "pelvis", "right_hip"},
               {"neck_length", "neck", "head"}};
  for (const auto& grown : bones) {
    const BodyModel taller = longer(human(), grown.name);
    check_body_model(taller);
    for (const auto& other : bones) {
      const Eigen::RowVector3d before = bone(human().skeleton, other.from, other.to);
      const Eigen::RowVector3d after = bone(taller.skeleton, other.from, other.to);
      const double more = std::string(grown.name) == other.name ? 0.03 : 0;
      EXPECT_NEAR(after.norm(), before.norm() + more, 1e-9) << grown.name << ", " << other.name;
      EXPECT_LT(after.cross(before).norm(), 1e-9);
    }
  }
}

TEST(BoneLengths, TrunkLength_MovesArmsAndHeadAlong) {
  const BodyModel taller = longer(human(), "trunk_length");
  EXPECT_NEAR(bone(taller.skeleton, "pelvis", "neck").norm(),
              bone(human().skeleton, "pelvis", "neck").norm() + 0.03, 1e-9);
  EXPECT_NEAR(bone(taller.skeleton, "left_shoulder", "left_wrist").norm(),
              bone(human().skeleton, "left_shoulder", "left_wrist").norm(), 1e-9);
  const Points moved = rest_positions(taller.skeleton) - rest_positions(human().skeleton);
  EXPECT_LT(moved.row(find_joint(human().skeleton, "left_ankle")).norm(), 1e-9);
  EXPECT_GT(moved.row(find_joint(human().skeleton, "left_wrist")).norm(), 0.02);
  EXPECT_NEAR(moved.row(find_joint(human().skeleton, "head")).norm(), 0.03, 1e-9);
}

TEST(BoneLengths, Skin_FollowsTheBone) {
  const BodyModel taller = longer(human(), "shin_length");
  const Points moved = taller.mesh.vertices - human().mesh.vertices;
  const Points rest = rest_positions(human().skeleton);
  const double knee = rest(find_joint(human().skeleton, "left_knee"), 1);
  const double ankle = rest(find_joint(human().skeleton, "left_ankle"), 1);
  for (Index v = 0; v < moved.rows(); ++v) {
    const double y = human().mesh.vertices(v, 1);
    if (y > knee + 0.12) {
      EXPECT_NEAR(moved(v, 1), 0.03, 0.001);
    } else if (y < ankle - 0.02) {
      EXPECT_NEAR(moved(v, 1), 0, 0.003);
    }
    EXPECT_LT(moved.row(v).norm(), 0.031);
  }
}

TEST(BoneLengths, ModelWithoutShapes_GetsASizeParameter) {
  const BodyModel bones = with_bone_lengths(human());
  ASSERT_GE(find_shape(bones, "size"), 0);
  Eigen::VectorXd shape = neutral_shape(bones);
  shape[find_shape(bones, "size")] = 0.1;
  const BodyModel larger = at_shape(bones, shape);
  EXPECT_TRUE(larger.mesh.vertices.isApprox(1.1 * human().mesh.vertices, 1e-12));
  EXPECT_TRUE(rest_positions(larger.skeleton).isApprox(1.1 * rest_positions(human().skeleton)));
  const BodyModel again = with_bone_lengths(bones);
  EXPECT_EQ(find_shape(again, "bone_size"), -1);
  EXPECT_GE(find_shape(again, "bone_thigh_length"), 0);
  check_body_model(again);
}

TEST(BoneLengths, MakeHumanBody_GetsBoneLengths) {
  ATELIER_TEST_FILE(base, "makehuman/base/base.obj");
  const BodyModel model = read_body_file(base).model;
  const BodyModel bones = with_bone_lengths(model);
  EXPECT_GE(bones.shape.size(), model.shape.size() + 9);
  check_body_model(bones);
}

TEST(BoneLengths, NonPerson_IsRefused) {
  BodyModel box;
  box.skeleton = {{"root"}, {-1}, Points::Zero(1, 3), {}, {}, {}};
  box.mesh = human().mesh;
  ATELIER_EXPECT_REFUSED(with_bone_lengths(box), DataError, "root");
  ATELIER_EXPECT_REFUSED(with_bone_lengths(human(), 0), LogicError, "bones");
}

}  // namespace
}  // namespace atelier::fixtures
