#include "bodymodel/unpose.h"

#include <gtest/gtest.h>

#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

TEST(Unpose, Unposing_InvertsPosing) {
  const BodyModel model = default_human();
  const ShapedBody body = shape_body(model);
  Random random{1, 0, 0};
  Pose pose = rest_pose(model.skeleton);
  pose.root_translation = {0.3, 1, -2};
  for (Index j = 0; j < pose.rotations.rows(); ++j) {
    pose.rotations.row(j) << uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3),
        uniform(random, -0.3, 0.3);
  }
  const SkinOptions plain{.correctives = false};
  Points posed = skin_vertices(model, body, pose, plain);
  EXPECT_LT((unposed_vertices(model, body, pose, posed) - body.vertices).cwiseAbs().maxCoeff(),
            1e-9);
  // What is off the model comes back where it was.
  posed.array() += 0.01;
  ShapedBody off = body;
  off.vertices = unposed_vertices(model, body, pose, posed);
  EXPECT_LT((skin_vertices(model, off, pose, plain) - posed).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Unpose, VerticesOfAnotherBody_AreRefused) {
  const BodyModel model = default_human();
  const Pose pose = rest_pose(model.skeleton);
  EXPECT_THROW(unposed_vertices(model, shape_body(model), pose, Points(3, 3)), LogicError);
}

}  // namespace
}  // namespace atelier
